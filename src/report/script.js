"use strict";
// The page works without this script. It adds the flip, buttons that copy commands, and unfolding for print and links.

for (const figure of document.querySelectorAll("figure.flip")) {
  const button = figure.querySelector(".view"), auto = figure.querySelector(".auto"), label = figure.querySelector("b");
  // Reuses the pictures beside the flip, so that the file contains each picture once.
  const [ours, reference] = ["ours", "reference"].map((side) => {
    const copy = document.getElementById(figure.dataset.scene + "-" + side).cloneNode();
    copy.removeAttribute("id");
    button.append(copy);
    return copy;
  });
  let shown = false, since = 0, timer = 0, held = false;
  const show = (other) => {
    shown = other;
    reference.style.visibility = other ? "visible" : "hidden";
    ours.style.visibility = other ? "hidden" : "visible";
    label.textContent = other ? "reference" : "ours";
  };
  const release = () => {
    if (held && performance.now() - since > 300) show(!shown);
    held = false;
  };
  button.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    held = true;
    since = performance.now();
    show(!shown);
  });
  for (const end of ["pointerup", "pointerleave", "pointercancel"]) button.addEventListener(end, release);
  // Keys cause clicks without a pointer.
  button.addEventListener("click", (event) => { if (event.detail === 0) show(!shown); });
  button.addEventListener("contextmenu", (event) => { if (held) event.preventDefault(); });
  auto.addEventListener("click", () => {
    const on = auto.getAttribute("aria-pressed") !== "true";
    auto.setAttribute("aria-pressed", on);
    label.setAttribute("aria-live", on ? "off" : "polite");
    clearInterval(timer);
    if (on) timer = setInterval(() => show(!shown), 700);
  });
  show(false);
  figure.hidden = false;
}

for (const line of document.querySelectorAll(".command")) {
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = "Copy";
  button.setAttribute("aria-label", "Copy the command " + line.textContent);
  button.addEventListener("click", async () => {
    const said = (text) => { button.textContent = text; setTimeout(() => { button.textContent = "Copy"; }, 1500); };
    try {
      await navigator.clipboard.writeText(line.querySelector("code").textContent);
      said("Copied");
    } catch {
      // A browser may deny access to the clipboard: select the text instead.
      getSelection().selectAllChildren(line.querySelector("code"));
      said("Selected");
    }
  });
  line.append(button);
}

const unfold = () => {
  const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  const folded = target && target.closest("details:not([open])");
  if (folded) { folded.open = true; target.scrollIntoView(); }
};
addEventListener("hashchange", unfold);
unfold();

let folded = [];
addEventListener("beforeprint", () => {
  folded = [...document.querySelectorAll("details:not([open])")];
  for (const details of folded) details.open = true;
});
addEventListener("afterprint", () => { for (const details of folded) details.open = false; });
