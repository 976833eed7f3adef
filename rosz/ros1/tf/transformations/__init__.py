"""tf.transformations: rotations, quaternions and 4x4 matrices (ROS wiki, tf/transformations).

Quaternions are ``[x, y, z, w]``; matrices act on column vectors; angles are radians. Results are
numpy arrays as in ROS 1; functions that return one need the extra ``rosz[numpy]``.

``Arcball`` and its helpers, ``clip_matrix``, ``projection_from_matrix`` and ``shear_from_matrix``
are missing.
"""

from rosz.ros1.tf.transformations.matrices import (
    compose_matrix,
    concatenate_matrices,
    decompose_matrix,
    identity_matrix,
    inverse_matrix,
    is_same_transform,
    orthogonalization_matrix,
    projection_matrix,
    random_rotation_matrix,
    reflection_from_matrix,
    reflection_matrix,
    rotation_from_matrix,
    rotation_matrix,
    scale_from_matrix,
    scale_matrix,
    shear_matrix,
    superimposition_matrix,
    translation_from_matrix,
    translation_matrix,
)
from rosz.ros1.tf.transformations.rotations import (
    euler_from_matrix,
    euler_from_quaternion,
    euler_matrix,
    quaternion_about_axis,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_from_matrix,
    quaternion_inverse,
    quaternion_matrix,
    quaternion_multiply,
    quaternion_slerp,
    random_quaternion,
    random_vector,
    unit_vector,
    vector_norm,
)

__all__ = (
    "compose_matrix",
    "concatenate_matrices",
    "decompose_matrix",
    "euler_from_matrix",
    "euler_from_quaternion",
    "euler_matrix",
    "identity_matrix",
    "inverse_matrix",
    "is_same_transform",
    "orthogonalization_matrix",
    "projection_matrix",
    "quaternion_about_axis",
    "quaternion_conjugate",
    "quaternion_from_euler",
    "quaternion_from_matrix",
    "quaternion_inverse",
    "quaternion_matrix",
    "quaternion_multiply",
    "quaternion_slerp",
    "random_quaternion",
    "random_rotation_matrix",
    "random_vector",
    "reflection_from_matrix",
    "reflection_matrix",
    "rotation_from_matrix",
    "rotation_matrix",
    "scale_from_matrix",
    "scale_matrix",
    "shear_matrix",
    "superimposition_matrix",
    "translation_from_matrix",
    "translation_matrix",
    "unit_vector",
    "vector_norm",
)
