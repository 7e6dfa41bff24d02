"""The page in English and German: the browser decides, until a person chooses."""

from __future__ import annotations

import ast
import json
import re
from typing import TYPE_CHECKING, Any

from ezdxf.filemanagement import new as new_drawing
from playwright.sync_api import expect

from planner import read_path
from planner.limits import JOINT_QUANTITIES
from tests.locations import ROOT
from web.tests.browser import TOO_SHORT, opened, planned
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from playwright.sync_api import Browser, Page

    from tests.api.conftest import RunningService

SHOWN = """() => {
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const texts = [...document.querySelectorAll('[aria-label], [title]')].flatMap((part) => [part.ariaLabel, part.title]);
  while (walker.nextNode()) texts.push(walker.currentNode.textContent);
  return texts.filter((text) => text).map((text) => text.trim());
}"""
"""Collects the texts and labels that the page shows."""

UNCHECKED: dict[str, Any] = {
    "robot": "ngv_refuelling_arm",
    "waypoints": [{"kind": "joint", "position": [angle, -0.4, 0.2, 0.0, 0.3, 0.0]} for angle in (0.1, 0.3)],
}
"""A request with a warning: the robot has no position limits."""
HOME = {"kind": "joint", "position": [0.1, -0.4, 0.2, 0.0, 0.3, 0.0]}
OUT_OF_REACH: dict[str, Any] = {
    "robot": "ngv_refuelling_arm",
    "waypoints": [HOME, {"kind": "pose", "pose": {"position": [9.0, 0.0, 0.0]}}, HOME, HOME],
}
"""A request whose waypoints have no order."""


def texts_of(language: str) -> set[str]:
    """Return the plain texts of a language, as its files have them."""
    files = (ROOT / "web/src/texts" / language).glob("*.ts")
    return {text for file in files for text in re.findall(r": '((?:[^'\\]|\\.)+)'", file.read_text())}


def shown(page: Page) -> set[str]:
    found: set[str] = set()
    for tab in page.get_by_role("tab").all():
        tab.click()
        found |= set(page.evaluate(SHOWN))
    return found


def test_a_german_browser_shows_german_and_a_person_may_change_that(browser: Browser, service: RunningService) -> None:
    english, german = texts_of("en"), texts_of("de")
    only_english, only_german = english - german - {"English"}, german - english - {"Deutsch"}
    with opened(browser, f"{service.url}/", locale="de-DE") as page:
        assert "Zertifiziert" in planned(page)
        assert page.evaluate("document.documentElement.lang") == "de"
        texts = shown(page)
        assert len(texts & only_german) > 50
        assert texts & only_english == set()
        assert violations(page) == []
        page.get_by_role("button", name="English").click()
        expect(page.locator(".verdict")).to_contain_text("Certified")
        assert page.evaluate("document.documentElement.lang") == "en"
        texts = shown(page)
        assert len(texts & only_english) > 50
        assert texts & only_german == set()
        page.reload()
        expect(page.get_by_role("button", name="Deutsch")).to_be_visible()


def warning_codes() -> Iterator[str]:
    """Yield the codes of all warnings that the library and the service make."""
    values = {"quantity": JOINT_QUANTITIES, "verb": ("starts", "ends")}
    for file in (*(ROOT / "planner").rglob("*.py"), *(ROOT / "api").rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text())):
            if not isinstance(node, ast.Call) or getattr(node.func, "id", "") != "PlanWarning":
                continue
            code = ast.unparse(node.args[0])
            if found := re.fullmatch(r"f'(.*)\{(\w+)\}(.*)'", code):
                yield from (f"{found[1]}{value}{found[3]}" for value in values[found[2]])
            elif not isinstance(node.args[0], ast.Starred):
                yield code.strip("'")


def test_every_warning_of_the_service_has_a_german_text() -> None:
    texts = (ROOT / "web/src/texts/de/warnings.ts").read_text()
    codes = set(warning_codes())
    assert len(codes) > 20
    assert set(re.findall(r"^  (\w+):", texts, re.MULTILINE)) == codes


def finding_codes() -> set[str]:
    """Return the codes of all findings about descriptions of robots that the library makes."""
    codes = set()
    for file in (ROOT / "planner/robots").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
                continue
            is_finding = "findings" in ast.unparse(node.func.value) and node.func.attr in ("error", "warning", "info")
            if is_finding and isinstance(node.args[0], ast.Constant):
                codes.add(str(node.args[0].value))
    return codes


def test_every_finding_about_a_robot_has_a_german_text() -> None:
    texts = (ROOT / "web/src/texts/de/findings.ts").read_text()
    codes = finding_codes()
    assert len(codes) > 80
    assert set(re.findall(r"^  (\w+):", texts, re.MULTILINE)) == codes


def test_every_note_on_a_path_file_has_a_german_text(tmp_path: Path) -> None:
    """The notes come from files of each kind; the page's patterns are read from its source."""
    drawing = new_drawing(units=0)
    for x in (0, 5):
        drawing.modelspace().add_line((x, 0), (x, 1))
    drawing.modelspace().add_text("no path")
    drawing.saveas(tmp_path / "path.dxf")
    (tmp_path / "path.gcode").write_text("G0 Z5\nM3 S900\nG0 X0 Y0\nG1 X5 E2\nG4 P2\nG43 H1\nX6\nT2 M6\nX7\nX8\nX9\n")
    (tmp_path / "path.csv").write_text("x,y,z,colour\n0,0,0,1\n1,0,0,1\n")
    read = [(f"path.{kind}", lift) for kind, lift in (("dxf", 0.0), ("dxf", 0.05), ("gcode", 0.0), ("csv", 0.0))]
    notes = [note for name, lift in read for note in read_path(tmp_path / name, lift=lift).notes]
    source = (ROOT / "web/src/texts/de/notes.ts").read_text()
    patterns = re.findall(r"/(\^.+\$)/,", source)
    assert len(notes) > 10
    assert [note for note in notes if not any(re.search(pattern, note) for pattern in patterns)] == []
    assert [pattern for pattern in patterns if not any(re.search(pattern, note) for note in notes)] == []
    left_out = {words for note in notes for words in re.findall(r"^lines? [^:]+: left out (.+)$", note)}
    assert all(words in source for words in left_out)


def use_german(page: Page, request: dict[str, Any]) -> None:
    page.get_by_role("tab", name="Anfrage").click()
    page.get_by_label("Die Anfrage als JSON").fill(json.dumps(request))
    page.get_by_role("button", name="Diese Anfrage verwenden").click()


def test_a_refusal_and_a_warning_are_in_german_with_their_original(browser: Browser, service: RunningService) -> None:
    """A remedy is in German, too: its change in words, and the original text of its effect behind a disclosure."""
    refused = service.client.post("/v1/trajectories", json=TOO_SHORT).json()
    with opened(browser, f"{service.url}/", locale="de-DE") as page:
        planned(page)
        use_german(page, TOO_SHORT)
        refusal = page.get_by_role("alert", name="Ablehnung")
        expect(refusal.get_by_role("heading", level=2)).to_have_text("Eine Dauer ist zu kurz für die Grenzen")
        expect(refusal).to_contain_text(
            f"Verlangt sind 0.5 s; die Grenzen brauchen mindestens {refused['limit']:.4g} s."
        )
        expect(refusal).to_contain_text(f"Wegpunkt 1, Dauer: {refused['remedies'][0]['value']:.4g} s")
        expect(refusal.get_by_text(refused["detail"])).to_be_hidden()
        expect(refusal.get_by_text(refused["remedies"][0]["explanation"])).to_be_hidden()
        for disclosure in refusal.get_by_text("Originaltext (englisch)").all():
            disclosure.click()
        expect(refusal.get_by_text(refused["detail"])).to_be_visible()
        assert violations(page) == []
        refusal.get_by_role("button", name="Anwenden").first.click()
        assert "Zertifiziert" in planned(page)
        use_german(page, UNCHECKED)
        page.get_by_role("tab", name="Zertifikat").click()
        expect(page.locator(".warnings")).to_contain_text("Nicht alle Gelenke haben Positionsgrenzen")
        expect(page.locator(".warnings")).to_contain_text("Originaltext (englisch)")
        use_german(page, OUT_OF_REACH)
        page.get_by_role("button", name="Beste Reihenfolge").click()
        answer = page.locator(".ordering [role=status]")
        expect(answer).to_contain_text("Die Pose liegt weiter weg, als der Arm reicht")
        expect(answer).to_contain_text("Originaltext (englisch)")
