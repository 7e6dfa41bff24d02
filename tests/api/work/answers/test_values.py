"""Values of the library as answers: each is valid in a request."""

import planner
from api.contract.parts import waypoints
from api.work.answers.values import value_answer


def test_the_answer_of_a_free_motion_is_valid_in_a_request() -> None:
    answer = value_answer(planner.FreeMotion(most_checks=70))
    assert answer == {"kind": "free", "most_checks": 70}
    assert waypoints.FreeMotion.model_validate(answer).most_checks == 70
