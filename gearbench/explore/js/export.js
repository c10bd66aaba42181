// The scene of the pick as a download of the browser; no file is written by the server.
const text = scene.data.text[0];
const name = (/^name = "(.*)"$/m.exec(text)?.[1] ?? "scene").replace(/[^\w]+/g, "_").slice(0, 80) + ".toml";
const link = document.createElement("a");
link.href = URL.createObjectURL(new Blob([text], { type: "application/toml" }));
link.download = name;
link.click();
setTimeout(() => URL.revokeObjectURL(link.href), 10000);
