// Keys and buttons of the live page -> what they do.

export function listen(parts, does) {
  const { playback } = does;
  const help = () => (parts.help.open ? parts.help.close() : parts.help.showModal());
  const KEYS = {
    " ": does.pause,
    z: does.zeroYaw,
    r: does.reset,
    l: does.live,
    Escape: does.live,
    "[": () => does.window(-1),
    "]": () => does.window(1),
    "?": help,
    p: () => playback.toggle(),
    ",": () => playback.step(-5),
    ".": () => playback.step(5),
    "-": () => playback.faster(-1),
    "+": () => playback.faster(1),
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const typing = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== "checkbox";
    const pressing = /^(BUTTON|INPUT|SUMMARY)$/.test(event.target.tagName) && event.key === " ";
    if (typing || pressing || !KEYS[event.key] || (parts.help.open && event.key === "Escape")) return;
    event.preventDefault();
    KEYS[event.key]();
  });
  parts.menu.addEventListener("click", () => {
    const isOpen = document.body.classList.toggle("opened");
    parts.menu.setAttribute("aria-expanded", String(isOpen));
  });
  parts.pause.addEventListener("click", does.pause);
  parts.zero.addEventListener("click", does.zeroYaw);
  parts.reset.addEventListener("click", does.reset);
  parts.live.addEventListener("click", does.live);
  parts.helpButton.addEventListener("click", help);
  parts.window.addEventListener("change", () => does.span(Number(parts.window.value)));
  parts.token.addEventListener("submit", (event) => {
    event.preventDefault();
    does.authorise(parts.tokenInput.value);
    parts.tokenInput.value = "";
  });
}
