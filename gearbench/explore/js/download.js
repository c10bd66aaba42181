// Offer a file as a download of the browser; the server writes no file.
function download(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// Download a scene file under the name of the scene. Characters other than letters, digits and _ are replaced, and "_"
// is added to names of Windows devices ("con", "com1").
function downloadScene(text) {
  const name = (/^name = "(.*)"$/m.exec(text)?.[1] ?? "scene").replace(/[^\w]+/g, "_").slice(0, 80) || "scene";
  const isDevice = /^(con|prn|aux|nul|com\d|lpt\d)$/i.test(name);
  download(new Blob([text], { type: "application/toml" }), `${name}${isDevice ? "_" : ""}.toml`);
}
