"""The schema of pictures names all that the library draws, without loading it."""

from typing import get_args

from api.contract.parts.pictures import PictureView, Shown
from planner.plots.picture import SHOWN
from planner.plots.view import VIEWS


def test_everything_that_can_be_drawn_can_be_asked() -> None:
    assert get_args(get_args(Shown.__value__)[0]) == SHOWN
    assert set(get_args(get_args(PictureView.__value__)[0])) == set(VIEWS)
