"""The readings' random numbers."""

import random

from sitl_mock.personality.px4.readings import Normals


def test_normals_are_those_of_python_however_they_are_taken():
    normals, gauss = Normals("seed"), random.Random("seed").gauss
    for count in [1, 3, 6, 2] * 20:
        assert normals.take(count) == [gauss(0.0, 1.0) for _ in range(count)]
