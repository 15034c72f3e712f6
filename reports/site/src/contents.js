// The contents are open where there is room beside the page.
export function openContents() {
  const contents = document.querySelector("details.contents");
  const wide = matchMedia("(min-width: 64rem)");
  const follow = () => { contents.open = wide.matches; };
  wide.addEventListener("change", follow);
  follow();
  contents.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest" });
}
