"""How well does every text of a page stand out from what is behind it (WCAG 2.1, section 1.4.3)?"""

from selenium.webdriver import Chrome

FIND = """
const found = [];
const walk = (root) => {
  for (const at of root.querySelectorAll("*")) {
    if (at.shadowRoot) walk(at.shadowRoot);
    const said = [...at.childNodes].filter((n) => n.nodeType === 3).map((n) => n.textContent.trim()).join(" ").trim();
    if (!said || !at.getClientRects().length) continue;
    if (["SCRIPT", "STYLE", "OPTION"].includes(at.tagName)) continue;
    let behind = at, colour = "rgba(0, 0, 0, 0)";
    while (behind && colour === "rgba(0, 0, 0, 0)") {
      colour = getComputedStyle(behind).backgroundColor;
      behind = behind.parentElement || (behind.getRootNode() && behind.getRootNode().host);
    }
    found.push([at.tagName + ": " + said.slice(0, 60), getComputedStyle(at).color, colour]);
  }
};
walk(document);
return found;
"""


def contrasts(shown: Chrome) -> dict[str, float]:
    """Return the contrast of every text that is shown to what is behind it, 1 to 21."""
    return {where: ratio(front, behind) for where, front, behind in shown.execute_script(FIND)}


def ratio(front: str, behind: str) -> float:
    """Return the contrast of two colours as a browser writes them; what has no colour behind it is on white."""
    light, dark = sorted((_luminance(front), _luminance(behind)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def _luminance(colour: str) -> float:
    """Return the relative luminance of ``rgb(...)`` or ``rgba(...)``, what is not opaque laid over white."""
    parts = [float(part) for part in colour[colour.index("(") + 1 : -1].split(",")]
    opaque = parts[3] if len(parts) == 4 else 1.0
    levels = [(part * opaque + 255.0 * (1.0 - opaque)) / 255.0 for part in parts[:3]]
    red, green, blue = (level / 12.92 if level <= 0.04045 else ((level + 0.055) / 1.055) ** 2.4 for level in levels)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
