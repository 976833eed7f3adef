//! The hash of each type that hiroz has and ROS 2's Jazzy has, too.

use hiroz::action::ZAction;
use hiroz::entity::TypeInfo;
use hiroz::{MessageTypeInfo, ServiceTypeInfo};
use hiroz_msgs::*;
use serde_json::Value;

use crate::say;

fn tell(info: TypeInfo) {
    say("hash", &format!("{} {}", info.name, info.hash.to_rihs_string()), Value::Null);
}

/// Prints the types of one kind in packages.
macro_rules! tell_all {
    (messages $($package:ident: $($name:ident)*;)*) => {
        $($(tell(<$package::$name as MessageTypeInfo>::type_info());)*)*
    };
    (services $($package:ident: $($name:ident)*;)*) => {
        $($(tell(<$package::srv::$name as ServiceTypeInfo>::service_type_info());)*)*
    };
    (actions $($package:ident: $($name:ident)*;)*) => {
        $($(
            tell(<$package::action::$name as ZAction>::send_goal_type_info());
            tell(<$package::action::$name as ZAction>::get_result_type_info());
            tell(<$package::action::$name as ZAction>::feedback_type_info());
        )*)*
    };
}

pub fn print() {
    tell_all!(
        messages
        action_msgs: GoalInfo GoalStatus GoalStatusArray;
        builtin_interfaces: Duration Time;
        diagnostic_msgs: DiagnosticArray DiagnosticStatus KeyValue;
        example_interfaces: Bool Byte ByteMultiArray Char Empty Float32 Float32MultiArray Float64
            Float64MultiArray Int16 Int16MultiArray Int32 Int32MultiArray Int64 Int64MultiArray
            Int8 Int8MultiArray MultiArrayDimension MultiArrayLayout String UInt16 UInt16MultiArray
            UInt32 UInt32MultiArray UInt64 UInt64MultiArray UInt8 UInt8MultiArray;
        geometry_msgs: Accel AccelStamped AccelWithCovariance AccelWithCovarianceStamped Inertia
            InertiaStamped Point Point32 PointStamped Polygon PolygonInstance
            PolygonInstanceStamped PolygonStamped Pose Pose2D PoseArray PoseStamped
            PoseWithCovariance PoseWithCovarianceStamped Quaternion QuaternionStamped Transform
            TransformStamped Twist TwistStamped TwistWithCovariance TwistWithCovarianceStamped
            Vector3 Vector3Stamped VelocityStamped Wrench WrenchStamped;
        lifecycle_msgs: State Transition TransitionDescription TransitionEvent;
        nav_msgs: Goals GridCells MapMetaData OccupancyGrid Odometry Path;
        rcl_interfaces: FloatingPointRange IntegerRange ListParametersResult LoggerLevel Parameter
            ParameterDescriptor ParameterEvent ParameterEventDescriptors ParameterType
            ParameterValue SetLoggerLevelsResult SetParametersResult;
        rosgraph_msgs: Clock;
        sensor_msgs: BatteryState CameraInfo ChannelFloat32 CompressedImage FluidPressure
            Illuminance Image Imu JointState Joy JoyFeedback JoyFeedbackArray LaserEcho LaserScan
            MagneticField MultiDOFJointState MultiEchoLaserScan NavSatFix NavSatStatus PointCloud
            PointCloud2 PointField Range RegionOfInterest RelativeHumidity Temperature
            TimeReference;
        service_msgs: ServiceEventInfo;
        shape_msgs: Mesh MeshTriangle Plane SolidPrimitive;
        std_msgs: Bool Byte ByteMultiArray Char ColorRGBA Empty Float32 Float32MultiArray Float64
            Float64MultiArray Header Int16 Int16MultiArray Int32 Int32MultiArray Int64
            Int64MultiArray Int8 Int8MultiArray MultiArrayDimension MultiArrayLayout String UInt16
            UInt16MultiArray UInt32 UInt32MultiArray UInt64 UInt64MultiArray UInt8 UInt8MultiArray;
        stereo_msgs: DisparityImage;
        tf2_msgs: TF2Error TFMessage;
        trajectory_msgs: JointTrajectory JointTrajectoryPoint MultiDOFJointTrajectory
            MultiDOFJointTrajectoryPoint;
        type_description_interfaces: Field FieldType IndividualTypeDescription KeyValue
            TypeDescription TypeSource;
        unique_identifier_msgs: UUID;
        visualization_msgs: ImageMarker InteractiveMarker InteractiveMarkerControl
            InteractiveMarkerFeedback InteractiveMarkerInit InteractiveMarkerPose
            InteractiveMarkerUpdate Marker MarkerArray MenuEntry MeshFile UVCoordinate;
    );
    tell_all!(
        services
        action_msgs: CancelGoal;
        diagnostic_msgs: AddDiagnostics SelfTest;
        example_interfaces: AddTwoInts SetBool Trigger;
        lifecycle_msgs: ChangeState GetAvailableStates GetAvailableTransitions GetState;
        nav_msgs: GetMap GetPlan LoadMap SetMap;
        rcl_interfaces: DescribeParameters GetLoggerLevels GetParameterTypes GetParameters
            ListParameters SetLoggerLevels SetParameters SetParametersAtomically;
        sensor_msgs: SetCameraInfo;
        std_srvs: Empty SetBool Trigger;
        tf2_msgs: FrameGraph;
        type_description_interfaces: GetTypeDescription;
        visualization_msgs: GetInteractiveMarkers;
    );
    tell_all!(
        actions
        action_tutorials_interfaces: Fibonacci;
        example_interfaces: Fibonacci;
        tf2_msgs: LookupTransform;
    );
}
