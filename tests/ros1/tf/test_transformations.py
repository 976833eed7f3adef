"""tf.transformations compared with the real one, and its mathematical properties."""

from __future__ import annotations

import math
import random
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from oracle import same

from rosz.errors import UsageError
from rosz.ros1.client.tf import transformations as t

ORDERS = [
    f"{frame}{a}{b}{c}"
    for frame in "sr"
    for a in "xyz"
    for b in "xyz"
    for c in "xyz"
    if b not in a + c
]
ANGLES = [
    (0.1, 0.2, 0.3), (-1.0, 0.5, 2.0), (3.0, -3.0, 1.0), (0.0, 0.0, 0.0), (0.3, math.pi / 2, 0.4),
    (0.3, -math.pi / 2, 0.4), (0.3, math.pi, 0.4), (math.pi, 0.0, -math.pi), (7.0, -8.0, 9.0),
]  # fmt: skip
_REAL = "tf.transformations", "python3-tf"


def test_all_orders_of_axes_are_tried() -> None:
    assert len(ORDERS) == 24


@pytest.mark.ros1
def test_angles_of_all_orders() -> None:
    same(
        f"""
        from tf import transformations as t
        result = []
        for axes in {ORDERS}:
            for angles in {ANGLES[:5] + ANGLES[8:]}:
                matrix = t.euler_matrix(*angles, axes=axes)
                quaternion = t.quaternion_from_euler(*angles, axes=axes)
                result.append([
                    axes, matrix, quaternion, t.euler_from_matrix(matrix, axes),
                    t.euler_from_quaternion(quaternion, axes),
                ])
        """,
        *_REAL,
    )


@pytest.mark.parametrize("axes", ORDERS)
def test_angles_come_to_the_same_rotation(axes: str) -> None:
    for angles in ANGLES:
        matrix = t.euler_matrix(*angles, axes)
        quaternion = t.quaternion_from_euler(*angles, axes)
        np.testing.assert_allclose(t.quaternion_matrix(quaternion), matrix, atol=1e-12)
        for found in (t.euler_from_matrix(matrix, axes), t.euler_from_quaternion(quaternion, axes)):
            np.testing.assert_allclose(t.euler_matrix(*found, axes), matrix, atol=1e-7)


@pytest.mark.ros1
def test_orders_as_numbers() -> None:
    same(
        """
        from tf import transformations as t
        result = [
            t.euler_matrix(0.1, 0.2, 0.3, (first, parity, repeated, frame))
            for first in range(3) for parity in (0, 1) for repeated in (0, 1) for frame in (0, 1)
        ]
        """,
        *_REAL,
    )


@pytest.mark.parametrize("axes", ["", "xyz", "sxxy", "sxyw", "qxyz"])
def test_invalid_orders_of_axes(axes: str) -> None:
    with pytest.raises(UsageError, match="not an order of axes"):
        t.euler_matrix(0, 0, 0, axes)


@pytest.mark.ros1
def test_quaternions() -> None:
    same(
        """
        from tf import transformations as t
        a, b = [0.1, -0.2, 0.3, 0.9], [0.5, 0.5, -0.5, 0.5]
        result = [
            t.quaternion_multiply(a, b), t.quaternion_multiply([1, 2, 3, 4], [5, 6, 7, 8]),
            t.quaternion_conjugate(a), t.quaternion_inverse(a), t.quaternion_matrix(a),
            t.quaternion_matrix([0, 0, 0, 0]), t.quaternion_about_axis(0.5, (0, 3, 0)),
            t.quaternion_about_axis(0.5, [1, 2, 3]), t.random_quaternion([0.1, 0.7, 0.4]),
            [t.quaternion_slerp(a, b, f) for f in (0, 0.0, 0.25, 1, 1.0)],
            t.quaternion_slerp(a, b, 0.5, spin=1), t.quaternion_slerp(a, a, 0.5),
            t.quaternion_slerp(a, [-x for x in b], 0.3),
            t.quaternion_slerp(a, [-x for x in b], 0.3, shortestpath=False),
        ]
        """,
        *_REAL,
    )


@pytest.mark.ros1
def test_quaternion_of_a_matrix() -> None:
    same(
        """
        from tf import transformations as t
        import math
        result = [
            t.quaternion_from_matrix(t.rotation_matrix(angle, axis))
            for angle in (0.1, 1.0, 2.0, 3.0, math.pi, -3.0)
            for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 2, 3], [-1, 2, 0.1])
        ]
        """,
        *_REAL,
    )


@pytest.mark.ros1
def test_matrices() -> None:
    same(
        """
        from tf import transformations as t
        result = [
            t.identity_matrix(), t.translation_matrix([1, 2, 3]), t.translation_matrix((1, 2, 3)),
            t.translation_from_matrix(t.translation_matrix([1, 2, 3])),
            t.rotation_matrix(0.3, [1, 2, 3]), t.rotation_matrix(0.3, [1, 2, 3], [4, 5, 6]),
            t.reflection_matrix([1, 2, 3], [0, 1, 1]), t.scale_matrix(-1.5),
            t.scale_matrix(2, [1, 2, 3]), t.scale_matrix(2, [1, 2, 3], [0, 1, 1]),
            t.shear_matrix(0.3, [1, 0, 0], [1, 2, 3], [0, 0, 1]),
            tried(t.shear_matrix, 0.3, [1, 0, 0], [1, 2, 3], [1, 0, 1]),
            t.projection_matrix([1, 2, 3], [0, 0, 1]),
            t.projection_matrix([1, 2, 3], [0, 0, 1], direction=[1, 1, 1]),
            t.projection_matrix([1, 2, 3], [0, 0, 1], perspective=[2, 1, 9]),
            t.projection_matrix([1, 2, 3], [0, 0, 1], perspective=[0, 0, 9], pseudo=True),
            t.orthogonalization_matrix((10, 9, 8), (90, 80, 70)),
            t.concatenate_matrices(t.scale_matrix(2), t.translation_matrix([1, 2, 3])),
            t.concatenate_matrices(), t.inverse_matrix(t.rotation_matrix(0.3, [1, 2, 3])),
            t.is_same_transform(t.identity_matrix(), t.identity_matrix()),
            t.is_same_transform(t.identity_matrix(), t.scale_matrix(2)),
            t.random_rotation_matrix([0.2, 0.3, 0.4]),
        ]
        """,
        *_REAL,
    )


@pytest.mark.ros1
def test_vectors() -> None:
    same(
        """
        from tf import transformations as t
        import numpy
        into = numpy.zeros(2)
        t.vector_norm([[3.0, 4], [6, 8]], axis=1, out=into)
        result = [
            t.vector_norm([3, 4, 12]), t.vector_norm([[3.0, 4], [6, 8]]), into,
            t.vector_norm([[3.0, 4], [6, 8]], axis=1), t.unit_vector([3, 4, 0]),
            t.unit_vector([[3.0, 4], [6, 8]], axis=1), t.unit_vector([[3.0, 4], [6, 8]], axis=0),
            list(t.random_vector(3).shape),
        ]
        """,
        *_REAL,
    )


@pytest.mark.ros1
def test_parts_of_a_matrix() -> None:
    same(
        """
        from tf import transformations as t
        whole = t.compose_matrix([1, 2, -3], [0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [7, 8, 9])
        seen = t.compose_matrix([1, 2, 3], None, [0.4, 0.5, 0.6], [7, 8, 9], [0.1, 0.2, 0.3, 1])
        points = [[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        moved = (t.concatenate_matrices(
            t.translation_matrix([1, 2, 3]), t.euler_matrix(0.1, 0.2, 0.3), t.scale_matrix(2)
        ) @ [*points, [1, 1, 1, 1]])[:3]
        result = [
            whole, t.decompose_matrix(whole), seen, t.decompose_matrix(seen), t.compose_matrix(),
            tried(t.decompose_matrix, [[0] * 4] * 4),
            t.superimposition_matrix(points, moved, scaling=True),
            t.superimposition_matrix(points, moved),
        ]
        """,
        *_REAL,
    )


@pytest.mark.ros1
def test_projections_and_views() -> None:
    same(
        """
        from tf import transformations as t
        seen = t.projection_matrix([1, 2, 3], [0, 0, 1], perspective=[2, 1, 9])
        oblique = t.projection_matrix([1, 2, 3], [0, 0, 1], direction=[1, 1, 1])
        sheared = t.shear_matrix(0.3, [1, 0, 0], [1, 2, 3], [0, 0, 1])
        ball = t.Arcball()
        ball.place([320, 320], 320)
        ball.down([500, 250])
        ball.drag([475, 275])
        result = [
            t.clip_matrix(-1, 1, -2, 2, 3, 4), t.clip_matrix(-1, 1, -2, 2, 3, 4, True),
            t.projection_matrix(*t.projection_from_matrix(oblique)),
            t.projection_matrix(*t.projection_from_matrix(seen, False)),
            t.shear_matrix(*t.shear_from_matrix(sheared)), ball.matrix(),
            t.arcball_map_to_sphere([330, 300], [320, 320], 320),
        ]
        """,
        *_REAL,
    )


def test_single_transformations_are_found_again() -> None:
    chance = random.Random(1)

    def vector() -> list[float]:
        return [chance.uniform(-1, 1) for _ in range(3)]

    for _ in range(20):
        turned = t.rotation_matrix(chance.uniform(-3, 3), vector(), vector())
        assert t.is_same_transform(turned, t.rotation_matrix(*t.rotation_from_matrix(turned)))
        mirrored = t.reflection_matrix(vector(), vector())
        assert t.is_same_transform(
            mirrored, t.reflection_matrix(*t.reflection_from_matrix(mirrored))
        )
        for scaled in (t.scale_matrix(0.5, vector()), t.scale_matrix(3.0, vector(), vector())):
            assert t.is_same_transform(scaled, t.scale_matrix(*t.scale_from_matrix(scaled)))


def test_matrices_that_are_not_rotations() -> None:
    with pytest.raises(ValueError, match="no unit eigenvector"):
        t.rotation_from_matrix(t.scale_matrix(2.0))


def test_messages_are_made_of_quaternions() -> None:
    from rosz.msgs.geometry_msgs.msg import Quaternion

    made = Quaternion(*t.quaternion_from_euler(0.0, 0.0, math.pi / 2))
    assert Quaternion.from_cdr(made.to_cdr()).z == pytest.approx(math.sqrt(0.5))
    roll, pitch, yaw = t.euler_from_quaternion([made.x, made.y, made.z, made.w])
    assert (roll, pitch, yaw) == pytest.approx((0.0, 0.0, math.pi / 2))


def test_without_numpy_it_says_what_to_install() -> None:
    script = """
        import sys
        sys.modules["numpy"] = None
        from rosz.ros1.client.tf import transformations as t
        print(t.euler_from_quaternion([0, 0, 0, 1]))
        try:
            t.quaternion_from_euler(0, 0, 1)
        except ModuleNotFoundError as error:
            print(error)
    """
    from textwrap import dedent

    done: Any = subprocess.run(
        [sys.executable, "-c", dedent(script)], check=True, capture_output=True, text=True
    )
    first, second = done.stdout.splitlines()
    assert first == "(0.0, -0.0, 0.0)"
    assert second.endswith("pip install 'rosz[numpy]'")
