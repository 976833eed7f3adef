"""PyKDL: vectors, rotations, frames, twists and wrenches (Orocos KDL).

Angles are radians. What needs the C++ of KDL is missing: chains, trees, solvers, inertias, and the
types with velocities. Unlike those of PyKDL 1.5, objects take attributes of their own, such as the
``header`` that `tf2_ros.Stamped` gives them.
"""

# KDL's name

from typing import Any

from rosz.ros1.PyKDL.frame import Equal, Frame, SetToZero, addDelta, diff, dot
from rosz.ros1.PyKDL.linear import Twist, Vector, Wrench
from rosz.ros1.PyKDL.rotation import Rotation

__all__ = (
    "Equal",
    "Frame",
    "Rotation",
    "SetToZero",
    "Twist",
    "Vector",
    "Wrench",
    "addDelta",
    "diff",
    "dot",
)

_IN_CPP = (
    "Add Chain ChainDynParam ChainFkSolverPos ChainFkSolverPos_recursive ChainFkSolverVel"
    " ChainFkSolverVel_recursive ChainIdSolver ChainIdSolver_RNE ChainIkSolverPos"
    " ChainIkSolverPos_LMA ChainIkSolverPos_NR ChainIkSolverPos_NR_JL ChainIkSolverVel"
    " ChainIkSolverVel_pinv ChainIkSolverVel_pinv_givens ChainIkSolverVel_pinv_nso"
    " ChainIkSolverVel_wdls ChainJntToJacDotSolver ChainJntToJacSolver Divide FrameVel Jacobian"
    " JntArray JntArrayVel JntSpaceInertiaMatrix Joint Multiply MultiplyJacobian RigidBodyInertia"
    " RotationVel RotationalInertia Segment SolverI Subtract Tree TwistVel VectorVel changeBase"
    " changeRefPoint doubleVel"
)


def __getattr__(name: str) -> Any:
    text = f"module 'PyKDL' of rosz has no attribute '{name}'"
    if name in _IN_CPP.split():
        text += (
            ": it needs KDL's C++, and rosz has the geometry alone; run this program with a Python"
            " that has the real PyKDL (Debian: python3-pykdl)"
        )
    raise AttributeError(text, name=name)
