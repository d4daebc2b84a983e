// before and after, one over the other; a handle tells how much is seen of each
const handles = [...document.querySelectorAll(".pair input")];
function slide(handle, value) {
  handle.value = value;
  handle.closest(".pair").style.setProperty("--at", value / 100);
}
for (const handle of handles) {
  handle.addEventListener("input", () => slide(handle, handle.value));
  slide(handle, handle.value);
}
document.getElementById("all")?.addEventListener("input", event => {
  for (const handle of handles) if (handle.closest(".close-ups")) slide(handle, 100 - event.target.value);
});
