"""XML from a client, parsed without trusting it: nothing it names is opened, nothing in it is expanded."""

from __future__ import annotations

from typing import Literal
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

from planner.robots.findings import Findings

MAX_TEXT_LENGTH = 2**20
"""Characters."""

NOT_EXPANDED = ("xacro", "XInclude")
"""Ends of the namespaces of elements that are to be expanded; the namespace of xacro has several spellings."""


def parse_robot_document(text: str, format: Literal["URDF", "SRDF"], findings: Findings) -> Element:
    """Return the root element, `<robot>`.

    Raises:
        InvalidRobotModel: Too long, not XML, with a DOCTYPE, with something left to expand, or not a robot.
    """
    if len(text) > MAX_TEXT_LENGTH:
        findings.error("document_too_large", None, f"the {format} is longer than {MAX_TEXT_LENGTH} characters")
        findings.raise_errors()
    document = Element("none")
    try:
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
        elif any(element.tag.rpartition("}")[0].endswith(NOT_EXPANDED) for element in document.iter()):
            # Passed over in silence, what they stand for would be missing from the robot.
            text = f"the {format} has xacro or XInclude elements: expand them first"
            findings.error("unexpanded_elements", None, text)
    findings.raise_errors()
    return document
