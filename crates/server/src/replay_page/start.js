(async () => {
  const packed = atob(document.getElementById("page-code").textContent.trim());
  const bytes = Uint8Array.from(packed, (one) => one.charCodeAt(0));
  const code = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  const script = document.createElement("script");
  script.type = "module";
  script.textContent = await new Response(code).text();
  document.body.append(script);
})().catch((error) => {
  document.getElementById("app").textContent =
    `This browser cannot show the replay (${error}). Use a newer one: Chrome or Edge 103, Firefox 113, Safari 16.4.`;
});
