"""Links of a folder of HTML pages that lead to no file, or to no place in it."""
import html.parser
import pathlib
import urllib.parse


class Page(html.parser.HTMLParser):
    """What a page points to, and the places in it that can be pointed to."""

    def __init__(self, text):
        super().__init__()
        self.links, self.places, self.fetched = [], set(), []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name == "id" or (name == "name" and tag == "a"):
                self.places.add(value)
            elif name in ("href", "src", "data") and value:
                self.links.append(value)
                # A link is followed by the reader; what a page is made of would need the network at once.
                if not (tag == "a" or urllib.parse.urlsplit(value).scheme in ("", "data", "javascript")):
                    self.fetched.append(value)

    handle_startendtag = handle_starttag


def dead_links(folder):
    """How many links to files there are, and a line for each dead one and each that is loaded from the network."""
    pages = {path: Page(path.read_text(errors="replace")) for path in sorted(pathlib.Path(folder).rglob("*.html"))}
    count, dead = 0, []
    for path, page in pages.items():
        place = path.relative_to(folder)
        dead += [f"{place}: {link} is loaded from the network" for link in page.fetched]
        for link in page.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            count += 1
            target = path.parent / urllib.parse.unquote(parts.path) if parts.path else path
            target = target.resolve()
            if not target.exists():
                dead.append(f"{place}: the link {link} leads to no file")
            elif parts.fragment and target in pages and urllib.parse.unquote(parts.fragment) not in pages[target].places:
                dead.append(f"{place}: the link {link} leads to no place in that file")
    return count, dead
