// Download the scene of the picked design.
downloadScene(scene.data.text[0]);
