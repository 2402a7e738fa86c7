for (const row of document.querySelectorAll("tr[data-frame]")) {
  const mark = document.getElementById("frame-" + row.dataset.frame);
  if (!mark) continue;
  const light = (on) => { row.classList.toggle("on", on); mark.classList.toggle("on", on); };
  for (const part of [row, mark]) {
    part.addEventListener("mouseenter", () => light(true));
    part.addEventListener("mouseleave", () => light(false));
  }
}
