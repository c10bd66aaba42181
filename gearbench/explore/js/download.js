// A file for the browser's folder of downloads; the server writes none.
function download(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// A scene file under the scene's name, which may hold anything: letters, digits and _ are kept, and no name of a device
// that Windows has ("con", "com1").
function downloadScene(text) {
  const named = (/^name = "(.*)"$/m.exec(text)?.[1] ?? "scene").replace(/[^\w]+/g, "_").slice(0, 80) || "scene";
  const device = /^(con|prn|aux|nul|com\d|lpt\d)$/i.test(named);
  download(new Blob([text], { type: "application/toml" }), `${named}${device ? "_" : ""}.toml`);
}
