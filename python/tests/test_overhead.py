"""What a call from Python costs beside the solver."""

import time

import calibench

MOST_US = 10.0


def test_a_call_on_four_views_of_63_points_costs_less_than_ten_microseconds_beside_the_solver() -> None:
    scene = calibench.Scene.example()
    points, pixels = scene.points, scene.observe(0.1, calibench.Stream(1, "overhead"))
    beside = []
    for _ in range(3000):
        started = time.perf_counter()
        result = calibench.calibrate(points, pixels, image_size=(640, 480))
        took = time.perf_counter() - started
        assert result.solver_seconds is not None
        beside.append(1e6 * (took - result.solver_seconds))
    # The least: whatever else the machine does only adds.
    assert min(beside) < MOST_US, f"{min(beside):.1f} us at least, {sorted(beside)[1500]:.1f} us in the middle"
