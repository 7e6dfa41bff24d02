"""XML from a client, parsed without trusting it: nothing it names is opened, nothing in it is expanded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

if TYPE_CHECKING:
    from planner.robots.checks import Findings

MAX_TEXT_LENGTH = 2**20
"""Characters."""


def parse_robot_document(text: str, format: Literal["URDF", "SRDF"], findings: Findings) -> Element:
    """The root element, `<robot>`.

    Args:
        text: The document.
        format: What it is, for the findings.
        findings: To add to.

    Raises:
        InvalidRobotModel: Too long, not XML, with a DOCTYPE, an unexpanded xacro, or not a robot.
    """
    document = Element("none")
    try:
        if len(text) > MAX_TEXT_LENGTH:
            findings.error("document_too_large", None, f"the {format} is longer than {MAX_TEXT_LENGTH} characters")
        else:
            document = fromstring(text, forbid_dtd=True, forbid_entities=True, forbid_external=True)
    except DefusedXmlException:
        findings.error("forbidden_xml", None, f"the {format} has a DOCTYPE or entities, which are not allowed")
    except ParseError as error:
        line, column = error.position
        findings.error("not_xml", None, f"the {format} is not well-formed XML: line {line}, column {column}")
    except ValueError:
        findings.error("not_xml", None, f"the {format} has characters that XML cannot have")
    else:
        if document.tag != "robot":
            findings.error("not_a_robot", None, f"the root element of a {format} is <robot>")
        elif any(_is_xacro(element) for element in document.iter()):
            # Left out silently, what a macro stands for would be missing from the robot.
            findings.error("xacro_left_in", None, f"the {format} has xacro elements: run xacro on it first")
    findings.raise_errors()
    return document


def _is_xacro(element: Element) -> bool:
    """Whether it is of xacro's namespace, of which there are several spellings."""
    return element.tag.startswith("{") and element.tag.partition("}")[0].endswith("xacro")
