// The scene of the pick as a download of the browser.
downloadScene(scene.data.text[0]);
