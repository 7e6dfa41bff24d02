"""Values of the library as answers: each is valid in a request."""

import planner
from api.contract.parts import free_motions
from api.work.answers.values import value_answer


def test_the_answer_of_a_free_motion_is_valid_in_a_request() -> None:
    answer = value_answer(planner.FreeMotion(most_checks=70))
    assert answer == {"kind": "free", "most_checks": 70}
    assert free_motions.FreeMotion.model_validate(answer).most_checks == 70
    upright = planner.ToolAxis((0.0, 0.0, -1.0), 0.3)
    answer = value_answer(planner.FreeMotion(keep=(upright,)))
    (kept,) = free_motions.FreeMotion.model_validate(answer).keep
    assert (kept.direction, kept.angle, kept.axis) == ([0.0, 0.0, -1.0], 0.3, [0.0, 0.0, 1.0])


def test_the_answer_of_every_pose_constraint_is_valid_in_a_request() -> None:
    for constraint in (
        planner.ToolOrientation((0.0, 1.0, 0.0, 0.0), 0.1),
        planner.ToolNearPlane((0.0, 0.0, 0.3), (0.0, 0.0, 1.0), 0.1),
        planner.ToolNearLine((0.0, 0.0, 0.3), (0.0, 1.0, 0.0), 0.1),
        planner.ToolInBox(planner.Pose.from_rpy([0.1, 0.2, 0.3], [0.1, 0.0, 0.0]), (0.1, 0.2, 0.3)),
        planner.ToolInHalfSpace((0.0, 0.0, 1.0), 0.7),
    ):
        answer = value_answer(planner.FreeMotion(keep=(constraint,)))
        (kept,) = free_motions.FreeMotion.model_validate(answer).keep
        assert kept.kind == constraint.kind
        assert kept.model_dump(exclude_unset=True) == answer["keep"][0]
