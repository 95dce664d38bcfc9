// Gazebo's systems in world files as programs and drives.
#include "worlds/gazebo/systems.h"

#include <absl/strings/str_replace.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "lpss/programs/registry.h"
#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

std::string wheel(const std::string& name, const std::string& pose) {
  return "<link name='" + name + "'><pose>" + pose + "</pose>" +
         collision("<cylinder><radius>0.2</radius><length>0.1</length></cylinder>") + "</link>";
}

std::string hinge(const std::string& name, const std::string& child, const std::string& parent = "base") {
  return "<joint name='" + name + "' type='revolute'><parent>" + parent + "</parent><child>" + child +
         "</child><axis><xyz>0 0 1</xyz></axis></joint>";
}

std::string cart(const std::string& plugin) {
  return world("<model name='cart'><link name='base'>" + kUnitBox + "</link>" + wheel("l", "0 0.7 0 0 0 0") +
               wheel("r", "0 -0.7 0 0 0 0") + hinge("left", "l") + hinge("right", "r") + plugin + "</model>");
}

const std::vector<ProgramRecord>& programs_of(const LoadedWorld& loaded, std::size_t body) {
  EXPECT_TRUE(check_programs(loaded.world).ok()) << check_programs(loaded.world);
  return loaded.world.bodies.at(body).programs;
}

TEST(SystemsOfFiles, AllSpellingsOfADifferentialDriveAreOne) {
  for (const char* names : {"filename='gz-sim-diff-drive-system' name='gz::sim::systems::DiffDrive'",
                            "filename='libignition-gazebo6-diff-drive-system.so' name='d'",
                            "name='ignition::gazebo::systems::DiffDrive'"}) {
    const LoadedWorld loaded = load(
        cart(std::string("<plugin ") + names +
             "><left_joint>left</left_joint><right_joint>right</right_joint><wheel_separation>1.4"
             "</wheel_separation><wheel_radius>0.2</wheel_radius><max_velocity>0.5</max_velocity></plugin>"));
    const ProgramRecord& drive = programs_of(loaded, 0).at(0);
    EXPECT_EQ(drive.kind, "diff_drive");
    EXPECT_EQ(number_of(drive, "left"), 1);
    EXPECT_EQ(number_of(drive, "right"), 2);
    EXPECT_EQ(number_of(drive, "left_2"), 0);
    EXPECT_EQ(number_of(drive, "track"), 1.4);
    EXPECT_EQ(number_of(drive, "radius"), 0.2);
    EXPECT_EQ(number_of(drive, "speed_max"), 0.5);
    EXPECT_EQ(number_of(drive, "speed"), 0) << "it stands until it is told to go";
  }
}

TEST(SystemsOfFiles, ClassicDrivesHaveTheirDiameterOrMeasureTheirWheels) {
  const LoadedWorld of_ros = load(cart(
      "<plugin name='p' filename='libgazebo_ros_diff_drive.so'><leftJoint>left</leftJoint><rightJoint>"
      "right</rightJoint><wheelSeparation>1.3</wheelSeparation><wheelDiameter>0.3</wheelDiameter></plugin>"));
  EXPECT_EQ(number_of(programs_of(of_ros, 0).at(0), "radius"), 0.15);
  EXPECT_EQ(number_of(programs_of(of_ros, 0).at(0), "track"), 1.3);
  const LoadedWorld measured = load(
      cart("<plugin name='p' filename='libDiffDrivePlugin.so'><left_joint>left</left_joint><right_joint>right"
           "</right_joint></plugin>"));
  EXPECT_EQ(number_of(programs_of(measured, 0).at(0), "radius"), 0.2);
  EXPECT_EQ(number_of(programs_of(measured, 0).at(0), "track"), 1.4);
}

TEST(SystemsOfFiles, AJointThatIsNotThereIsNamed) {
  const LoadedWorld loaded = load(cart(
      "<plugin name='p' filename='gz-sim-diff-drive-system'><left_joint>lift</left_joint><right_joint>right"
      "</right_joint></plugin>"));
  EXPECT_THAT(programs_of(loaded, 0), IsEmpty());
  EXPECT_THAT(
      loaded.repairs,
      Contains(HasSubstr("gz-sim-diff-drive-system, left out: there is no joint 'lift' in its model")));
}

TEST(SystemsOfFiles, ControllersOfJointsArePrograms) {
  const LoadedWorld loaded = load(
      cart("<plugin name='p' filename='gz-sim-joint-position-controller-system'><joint_name>left</joint_name>"
           "<p_gain>20</p_gain><i_gain>2</i_gain><cmd_max>50</cmd_max><initial_position>0.3</"
           "initial_position></plugin>"
           "<plugin name='q' filename='gz-sim-joint-controller-system'><joint_name>right</joint_name>"
           "<initial_velocity>5</initial_velocity></plugin>"));
  const ProgramRecord& pid = programs_of(loaded, 1).at(0);
  EXPECT_EQ(pid.kind, "pid");
  EXPECT_EQ(number_of(pid, "joint"), 1);
  EXPECT_EQ(number_of(pid, "p"), 20);
  EXPECT_EQ(number_of(pid, "i"), 2);
  EXPECT_EQ(number_of(pid, "d"), 0.01);
  EXPECT_EQ(number_of(pid, "effort_max"), 50);
  EXPECT_EQ(number_of(pid, "set_point"), 0.3);
  EXPECT_EQ(loaded.world.joints.at(1).drives[0].mode, DriveMode::kVelocity);
  EXPECT_EQ(loaded.world.joints.at(1).drives[0].target, 5);
}

TEST(SystemsOfFiles, TwoJointsOfAModelEachHaveTheirOwnGains) {
  const LoadedWorld loaded = load(cart(
      "<plugin name='p' filename='gz-sim-joint-trajectory-controller-system'><joint_name>left</joint_name>"
      "<joint_name>right</joint_name><position_p_gain>10</position_p_gain><position_p_gain>20"
      "</position_p_gain></plugin>"));
  EXPECT_EQ(number_of(programs_of(loaded, 1).at(0), "p"), 10);
  EXPECT_EQ(number_of(programs_of(loaded, 2).at(0), "p"), 20);
}

TEST(SystemsOfFiles, AMimicPluginIsAMimic) {
  const LoadedWorld loaded = load(
      cart("<plugin name='p' filename='libroboticsgroup_gazebo_mimic_joint_plugin.so'><joint>left</joint>"
           "<mimicJoint>right</mimicJoint><multiplier>-1</multiplier></plugin>"));
  EXPECT_EQ(loaded.world.joints.at(1).properties.axes[0].mimic.leader.value, 1u);
  EXPECT_EQ(loaded.world.joints.at(1).properties.axes[0].mimic.multiplier, -1);
}

TEST(SystemsOfFiles, ARotorPushesAlongItsAxis) {
  const LoadedWorld loaded = load(cart(
      "<plugin name='p' filename='gz-sim-multicopter-motor-model-system'><jointName>left</jointName>"
      "<linkName>l</linkName><turningDirection>ccw</turningDirection><maxRotVelocity>1000</maxRotVelocity>"
      "<motorConstant>1e-5</motorConstant><momentConstant>0.02</momentConstant></plugin>"));
  const ProgramRecord& rotor = programs_of(loaded, 1).at(0);
  EXPECT_EQ(rotor.kind, "thruster");
  EXPECT_NEAR(number_of(rotor, "force"), 10, 1e-12);
  EXPECT_EQ(number_of(rotor, "reaction"), -0.02);
  EXPECT_EQ(number_of(rotor, "rise"), std::numbers::pi / 2);
}

TEST(SystemsOfFiles, AWingHasNoLiftWhereGazeboHasNone) {
  const LoadedWorld loaded =
      load(cart("<plugin name='p' "
                "filename='libLiftDragPlugin.so'><link_name>base</link_name><a0>0.05</a0><cla>4.75</cla>"
                "<cda>0.64</cda><alpha_stall>0.3</alpha_stall><cp>-0.1 0.4 0</cp><area>0.6</area><upward>0 "
                "-1 0</upward>"
                "</plugin>"));
  const ProgramRecord& wing = programs_of(loaded, 0).at(0);
  EXPECT_EQ(number_of(wing, "zero_lift"), -0.05);
  EXPECT_EQ(number_of(wing, "y"), 0.4);
  EXPECT_NEAR(number_of(wing, "roll"), std::numbers::pi / 2, 1e-15);
  EXPECT_EQ(number_of(wing, "turn"), 0);
  const LoadedWorld aside = load(cart(
      "<plugin name='p' filename='libLiftDragPlugin.so'><link_name>base</link_name><forward>0 2 0</forward>"
      "<upward>0 0 1</upward></plugin>"));
  EXPECT_NEAR(number_of(programs_of(aside, 0).at(0), "turn"), std::numbers::pi / 2, 1e-15);
  EXPECT_NEAR(number_of(programs_of(aside, 0).at(0), "roll"), 0, 1e-15);
  // At the angle of stall, the drag is Gazebo's.
  const double lift = 4.75 * 0.3;
  EXPECT_NEAR(number_of(wing, "induced") * lift * lift, 0.64 * 0.3, 1e-15);
}

TEST(SystemsOfFiles, ATouchPluginIsASensorOfItsFirstLink) {
  const LoadedWorld loaded =
      load(cart("<plugin name='gz::sim::systems::TouchPlugin' filename='gz-sim-touchplugin-system'/>"));
  EXPECT_EQ(programs_of(loaded, 0).at(0).kind, "touch");
}

TEST(SystemsOfFiles, WhatTesseraDoesOfItselfIsNoNews) {
  const LoadedWorld loaded =
      load(world("<plugin filename='gz-sim-physics-system' name='gz::sim::systems::Physics'/>"
                 "<plugin filename='gz-sim-camera-video-recorder-system' name='b'/>" +
                 model("m",
                       "<plugin filename='gz-sim-joint-state-publisher-system' name='j'/>"
                       "<plugin filename='libmine.so' name='x'/>")));
  EXPECT_THAT(loaded.notices, testing::UnorderedElementsAre(
                                  "1 x <plugin> gz-sim-camera-video-recorder-system skipped: nothing is "
                                  "rendered",
                                  "1 x <plugin> libmine.so skipped"));
}

TEST(SystemsOfFiles, PluginsOfAnIncludeAreForItsModelAlone) {
  const Folder folder;
  folder.write("m.sdf", model_file(model("m", "")));
  const LoadedWorld loaded = load(world("<include><uri>m.sdf</uri><name>a</name><plugin name='p' "
                                        "filename='gz-sim-odometry-publisher-system'/>"
                                        "</include><include><uri>m.sdf</uri><name>b</name></include>"),
                                  folder);
  EXPECT_EQ(programs_of(loaded, 0).at(0).kind, "pose");
  EXPECT_THAT(programs_of(loaded, 1), IsEmpty());
}

TEST(SystemsOfFiles, JointsOfRosControlHoldWhereTheyAre) {
  const Folder folder;
  const auto robot = [](const std::string& control) {
    return "<robot name='r'><link name='base'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' "
           "ixy='0' "
           "ixz='0' iyz='0'/></inertial></link><link name='arm'><inertial><mass value='1'/><inertia ixx='1' "
           "iyy='1' "
           "izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='j' type='continuous'><parent "
           "link='base'/><child link='arm'/><axis xyz='0 1 0'/></joint>" +
           control + "</robot>";
  };
  const auto drive_of = [&](const std::string& control) {
    const std::filesystem::path file = folder.write("r.urdf", robot(control)) / "r.urdf";
    return load_world_file(file).value().world.joints.at(0).drives[0];
  };
  const std::string plugin = "<gazebo><plugin name='c' filename='libgazebo_ros_control.so'/></gazebo>";
  const std::string transmission =
      "<transmission name='t'><joint name='j'><hardwareInterface>hardware_interface/PositionJointInterface"
      "</hardwareInterface></joint></transmission>";
  EXPECT_EQ(drive_of(plugin + transmission).mode, DriveMode::kPosition);
  EXPECT_EQ(drive_of(transmission).mode, DriveMode::kFree) << "nobody commands it";
  const JointDrive drive = drive_of(
      "<gazebo><plugin name='c' filename='gz_ros2_control-system'/></gazebo><ros2_control name='s' "
      "type='system'>"
      "<joint name='j'><command_interface name='position'/><state_interface name='position'><param "
      "name='initial_value'>0.4</param></state_interface></joint></ros2_control>");
  EXPECT_EQ(drive.mode, DriveMode::kPosition);
  EXPECT_EQ(drive.target, 0.4);
}

TEST(SystemsOfFiles, WhatMovesByVelocitiesIsLed) {
  const LoadedWorld free = load(cart(
      "<plugin name='p' filename='gz-sim-velocity-control-system'><initial_linear>0.3 0 0.1</initial_linear>"
      "<initial_angular>0 0 -0.2</initial_angular></plugin>"));
  const ProgramRecord& led = programs_of(free, 0).at(0);
  EXPECT_EQ(led.kind, "velocity_control");
  EXPECT_EQ(number_of(led, "planar"), 0);
  EXPECT_EQ(number_of(led, "x"), 0.3);
  EXPECT_EQ(number_of(led, "z"), 0.1);
  EXPECT_EQ(number_of(led, "turn_z"), -0.2);
  const LoadedWorld planar =
      load(cart("<plugin name='p' "
                "filename='libgazebo_ros_planar_move.so'><robotBaseFrame>base</robotBaseFrame></plugin>"));
  EXPECT_EQ(number_of(programs_of(planar, 0).at(0), "planar"), 1);
  EXPECT_EQ(programs_of(planar, 0).at(1).kind, "pose");
  const LoadedWorld mecanum = load(
      cart("<plugin name='p' filename='gz-sim-mecanum-drive-system'><front_left_joint>left</front_left_joint>"
           "<max_linear_acceleration>2</max_linear_acceleration></plugin>"));
  EXPECT_EQ(number_of(programs_of(mecanum, 0).at(0), "acceleration"), 2);
}

TEST(SystemsOfFiles, ATrajectoryFollowerHasItsWaypoints) {
  const auto follower = [](const std::string& course) {
    const LoadedWorld loaded =
        load(world("<model name='cart'><pose>3 4 0 0 0 0</pose><link name='base'>" + kUnitBox +
                   "</link><plugin name='p' "
                   "filename='gz-sim-trajectory-follower-system'><link_name>base</link_name><force>10"
                   "</force><bearing_tolerance>9</bearing_tolerance><loop>true</loop>" +
                   course + "</plugin></model>"));
    EXPECT_EQ(programs_of(loaded, 0).size(), 1u) << (loaded.repairs.empty() ? "" : loaded.repairs.at(0));
    return programs_of(loaded, 0).at(0);
  };
  const ProgramRecord places =
      follower("<waypoints><waypoint>25 0</waypoint><waypoint>15 -2</waypoint></waypoints>");
  EXPECT_EQ(places.kind, "waypoints");
  for (const auto& [name, value] : {std::pair{"count", 2.0},
                                    {"loop", 1.0},
                                    {"force", 10.0},
                                    {"torque", 50.0},
                                    {"range", 0.5},
                                    {"bearing", std::numbers::pi / 20},
                                    {"hold", 0.0},
                                    {"axes", 0.0},
                                    {"from_x", 3.0},
                                    {"from_y", 4.0},
                                    {"x_1", 15.0},
                                    {"y_1", -2.0}})
    EXPECT_NEAR(number_of(places, name), value, 1e-15) << name;
  const ProgramRecord circle = follower("<circle><radius>2</radius></circle>");
  EXPECT_EQ(number_of(circle, "count"), 8);
  EXPECT_EQ(number_of(circle, "axes"), 1);
  EXPECT_NEAR(number_of(circle, "y_2"), 2, 1e-15);
  const ProgramRecord line = follower("<line><direction>0</direction><length>5</length></line>");
  EXPECT_EQ(number_of(line, "count"), 2);
  EXPECT_EQ(number_of(line, "axes"), 2);
  EXPECT_EQ(number_of(line, "x_1"), 5);
}

TEST(SystemsOfFiles, ATrajectoryFollowerWithoutACourseIsLeftOut) {
  const std::string before =
      "<plugin name='p' filename='gz-sim-trajectory-follower-system'><link_name>base</link_name>";
  EXPECT_THAT(load(cart(before + "</plugin>")).repairs,
              Contains(HasSubstr("it has no <waypoint>, <circle> or <line>")));
  EXPECT_THAT(load(cart(before + "<waypoints><waypoint>1</waypoint></waypoints></plugin>")).repairs,
              Contains(HasSubstr("a <waypoint> must have two numbers")));
}

TEST(SystemsOfFiles, AMulticopterKnowsItsRotors) {
  const std::string rotor =
      "<rotor><jointName>JOINT</jointName><forceConstant>1e-5</forceConstant><momentConstant>"
      "0.02</momentConstant><direction>1</direction></rotor>";
  const auto of = [&](const std::string& joint) { return absl::StrReplaceAll(rotor, {{"JOINT", joint}}); };
  const LoadedWorld loaded = load(
      cart("<plugin name='m' filename='gz-sim-multicopter-motor-model-system'><jointName>left</jointName>"
           "<maxRotVelocity>1000</maxRotVelocity></plugin>"
           "<plugin name='p' filename='gz-sim-multicopter-control-system'><comLinkName>base</comLinkName>"
           "<rotorConfiguration>" +
           of("left") + of("right") +
           "</rotorConfiguration><maximumLinearAcceleration>1 1 2</maximumLinearAcceleration></plugin>"));
  const ProgramRecord& drone = programs_of(loaded, 0).at(0);
  EXPECT_EQ(drone.kind, "multicopter");
  EXPECT_NEAR(number_of(drone, "thrust"), 10 + 6.4, 1e-9) << "800 rad/s, where nothing else is said";
  EXPECT_NEAR(number_of(drone, "torque"), 16.4 * 0.7 / 2, 1e-9);
  EXPECT_NEAR(number_of(drone, "turn_torque"), 16.4 * 0.02 / 2, 1e-9);
  EXPECT_EQ(number_of(drone, "acceleration"), 1);
  EXPECT_EQ(programs_of(loaded, 1).at(0).kind, "thruster");
}

TEST(SystemsOfFiles, DerivativesOfAVesselAreItsDragAndItsAddedMass) {
  const LoadedWorld loaded = load(cart(
      "<plugin name='p' filename='gz-sim-hydrodynamics-system'><link_name>base</link_name><xDotU>-4.9</xDotU>"
      "<nDotR>-33</nDotR><xU>-1.5</xU><xUabsU>-6.2</xUabsU><yVV>-601</yVV><nRR>-632</nRR><default_current>0 "
      "1 0"
      "</default_current></plugin>"));
  const ProgramRecord& hull = programs_of(loaded, 0).at(0);
  EXPECT_EQ(hull.kind, "hydrodynamics");
  EXPECT_EQ(number_of(hull, "mass_x"), 4.9);
  EXPECT_EQ(number_of(hull, "inertia_z"), 33);
  EXPECT_EQ(number_of(hull, "drag_x"), 1.5);
  EXPECT_EQ(number_of(hull, "square_drag_x"), 6.2);
  EXPECT_EQ(number_of(hull, "square_drag_y"), 601);
  EXPECT_EQ(number_of(hull, "square_turn_drag_z"), 632);
  EXPECT_EQ(number_of(hull, "current_y"), 1);
}

TEST(SystemsOfFiles, TheAddedMassOfALinkIsThatOfItsProgram) {
  const auto with = [](const std::string& plugin) {
    return load(
        world("<model name='m'><link "
              "name='base'><inertial><mass>5</mass><fluid_added_mass><xx>2</xx><zz>3</zz><rr>4</rr>"
              "<xy>0.1</xy></fluid_added_mass></inertial>" +
              kUnitBox + "</link>" + plugin + "</model>"));
  };
  const LoadedWorld alone = with("");
  const ProgramRecord& hull = programs_of(alone, 0).at(0);
  EXPECT_EQ(hull.kind, "hydrodynamics");
  EXPECT_EQ(hull.name, "added_mass");
  EXPECT_EQ(number_of(hull, "mass_x"), 2);
  EXPECT_EQ(number_of(hull, "mass_z"), 3);
  EXPECT_EQ(number_of(hull, "inertia_z"), 4);
  EXPECT_THAT(alone.notices, Contains("1 x <fluid_added_mass> is the program hydrodynamics"));
  EXPECT_THAT(alone.notices, Contains("1 x <fluid_added_mass>: parts beside the diagonal are not simulated"));
  const std::string plugin =
      "<plugin name='p' filename='gz-sim-hydrodynamics-system'><link_name>base</link_name><xDotU>-1</xDotU>"
      "<xU>-7</xU>";
  const LoadedWorld both = with(plugin + "</plugin>");
  ASSERT_EQ(programs_of(both, 0).size(), 1u) << "one program has both";
  EXPECT_EQ(number_of(programs_of(both, 0).at(0), "mass_x"), 3);
  EXPECT_EQ(number_of(programs_of(both, 0).at(0), "drag_x"), 7);
  const LoadedWorld disabled = with(plugin + "<disable_added_mass>true</disable_added_mass></plugin>");
  EXPECT_EQ(number_of(programs_of(disabled, 0).at(0), "mass_x"), 2);
}

TEST(SystemsOfFiles, ADetectorOfPerformersIsAZoneThatCounts) {
  const auto zone = [](const std::string& in_link, const std::string& size) {
    return load(world("<model name='zone'><static>true</static><pose>1 2 3 0 0 0</pose><link name='l'>" +
                      in_link +
                      "</link><plugin name='p' filename='gz-sim-performer-detector-system'><pose>0 0 1 0 0 0"
                      "</pose><geometry><box><size>" +
                      size + "</size></box></geometry></plugin></model>"));
  };
  const LoadedWorld loaded = zone("<pose>0 0 0.5 0 0 0</pose>", "4 4 2");
  const BodyDescription& body = loaded.world.bodies.at(0);
  EXPECT_EQ(programs_of(loaded, 0).at(0).kind, "pad");
  EXPECT_EQ(body.properties.motion, Motion::kKinematic);
  EXPECT_TRUE(body.properties.trigger);
  EXPECT_THAT(zone(kUnitBox, "4 4 2").repairs, Contains(HasSubstr("its model is static and has collisions")));
  EXPECT_THAT(zone("", "4 400 2").repairs, Contains(HasSubstr("be at most 100 m across")));
}

TEST(SystemsOfFiles, WaterLiftsWhatHasAVolume) {
  const std::string ball =
      "<pose>0 0 2 0 0 0</pose><collision name='c'><pose>0 0 0.1 0 0 0</pose><geometry><sphere>"
      "<radius>0.5</radius></sphere></geometry></collision>";
  const auto in_water = [&](const std::string& water) {
    return load(world("<plugin name='p' filename='gz-sim-buoyancy-system'>" + water + "</plugin>" +
                      model("ball", "", ball) + "<model name='wall'><static>true</static><link name='l'>" +
                      kUnitBox + "</link></model>"));
  };
  const LoadedWorld deep = in_water("<uniform_fluid_density>1025</uniform_fluid_density>");
  const ProgramRecord& floater = programs_of(deep, 0).at(0);
  EXPECT_EQ(floater.kind, "floater");
  EXPECT_EQ(number_of(floater, "density"), 1025);
  EXPECT_EQ(number_of(floater, "level"), 1e4);
  EXPECT_EQ(number_of(floater, "drag"), 0);
  EXPECT_NEAR(number_of(floater, "z"), 0.1, 1e-12);
  const double volume =
      number_of(floater, "length") * number_of(floater, "width") * number_of(floater, "height");
  EXPECT_NEAR(volume, 4.0 / 3 * std::numbers::pi / 8, 1e-9);
  EXPECT_THAT(programs_of(deep, 1), IsEmpty());
  const LoadedWorld surface = in_water(
      "<graded_buoyancy><default_density>1000</default_density><density_change><above_depth>0.5</above_depth>"
      "<density>1</density></density_change></graded_buoyancy>");
  EXPECT_EQ(number_of(programs_of(surface, 0).at(0), "level"), -1.5) << "it starts 2 m above the origin";
  EXPECT_EQ(number_of(programs_of(surface, 0).at(0), "air"), 1);
  EXPECT_THAT(programs_of(in_water("<enable>wall</enable>"), 0), IsEmpty());
}

TEST(SystemsOfFiles, WindBlowsOnWhatFeelsIt) {
  const LoadedWorld loaded =
      load(world("<wind><linear_velocity>3 1 0</linear_velocity></wind><plugin name='p' "
                 "filename='gz-sim-wind-effects-system'><force_approximation_scaling_factor>0.5"
                 "</force_approximation_scaling_factor></plugin>" +
                 model("leaf", "<enable_wind>true</enable_wind>") + model("stone", "")));
  const ProgramRecord& wind = programs_of(loaded, 0).at(0);
  EXPECT_EQ(wind.kind, "wind");
  EXPECT_EQ(number_of(wind, "damping"), 0.5);
  EXPECT_EQ(number_of(wind, "x"), 3);
  EXPECT_EQ(number_of(wind, "y"), 1);
  EXPECT_THAT(programs_of(loaded, 1), IsEmpty());
}

TEST(SystemsOfFiles, ADetachableJointHoldsUntilItIsReleased) {
  const std::string plugin =
      "<plugin name='drop' filename='gz-sim-detachable-joint-system'><parent_link>l</parent_link>"
      "<child_model>CHILD</child_model><child_link>l</child_link></plugin>";
  const auto with = [&](const std::string& child) {
    return load(world(model("truck", absl::StrReplaceAll(plugin, {{"CHILD", child}})) + model("crate", "")));
  };
  const LoadedWorld loaded = with("crate");
  ASSERT_EQ(loaded.world.joints.size(), 1u);
  const JointProperties& joint = loaded.world.joints[0].properties;
  EXPECT_EQ(joint.type, JointType::kFixed);
  EXPECT_EQ(joint.parent.value, 1u);
  EXPECT_EQ(joint.child.value, 2u);
  const ProgramRecord& breaker = programs_of(loaded, 0).at(0);
  EXPECT_EQ(breaker.kind, "breaker");
  EXPECT_EQ(breaker.name, "drop");
  EXPECT_EQ(number_of(breaker, "joint"), 1);
  const LoadedWorld alone = with("cart");
  EXPECT_THAT(alone.world.joints, IsEmpty());
  EXPECT_THAT(alone.repairs, Contains(HasSubstr("there is no <model> 'cart' beside its own")));
}

TEST(SystemsOfFiles, TracksRunAroundTheirLinks) {
  const LoadedWorld loaded = load(cart(
      "<plugin name='p' filename='gz-sim-tracked-vehicle-system'><left_track><link>l</link></left_track>"
      "<right_track><link>r</link></right_track><tracks_separation>0.4</tracks_separation><linear_velocity>"
      "<max_acceleration>3</max_acceleration></linear_velocity></plugin>"));
  const ProgramRecord& treads = programs_of(loaded, 0).at(0);
  EXPECT_EQ(treads.kind, "treads");
  EXPECT_EQ(number_of(treads, "left"), 2);
  EXPECT_EQ(number_of(treads, "right"), 3);
  EXPECT_EQ(number_of(treads, "left_2"), 0);
  EXPECT_EQ(number_of(treads, "separation"), 0.4);
  EXPECT_EQ(number_of(treads, "efficiency"), 0.5);
  EXPECT_EQ(number_of(treads, "acceleration"), 3);
}

TEST(SystemsOfFiles, AConveyorThatDoesNotMoveIsLed) {
  const LoadedWorld loaded = load(world(
      model("belt",
            "<static>true</static><plugin name='p' filename='gz-sim-track-controller-system'><link>l</link>"
            "<max_acceleration>0.5</max_acceleration></plugin>")));
  EXPECT_EQ(loaded.world.bodies.at(0).properties.motion, Motion::kKinematic);
  const ProgramRecord& belt = programs_of(loaded, 0).at(0);
  EXPECT_EQ(belt.kind, "belt");
  EXPECT_EQ(number_of(belt, "round"), 1);
  EXPECT_EQ(number_of(belt, "acceleration"), 0.5);
}

}  // namespace
}  // namespace tessera
