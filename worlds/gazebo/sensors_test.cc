// Sensors of world files as programs.
#include "worlds/gazebo/sensors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "lpss/programs/registry.h"
#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

LoadedWorld load_sensor(const std::string& sensor, const std::string& of_world = "") {
  return load(world(of_world + model("m", "<pose>1 2 3 0 0 0</pose>", kUnitBox + sensor)));
}

ProgramRecord program_of(const std::string& sensor, const std::string& of_world = "") {
  const LoadedWorld loaded = load_sensor(sensor, of_world);
  EXPECT_EQ(loaded.world.bodies.at(0).programs.size(), 1u);
  EXPECT_TRUE(check_programs(loaded.world).ok()) << check_programs(loaded.world);
  return loaded.world.bodies.at(0).programs.at(0);
}

TEST(SensorsOfFiles, AnImuHasItsPlaceItsTurnAndItsNoise) {
  const ProgramRecord imu = program_of(
      "<sensor name='nose' type='imu'><pose>0.1 0.2 0.3 0 0 1.5</pose><imu>"
      "<angular_velocity><x><noise type='gaussian'><stddev>0.01</stddev></noise></x>"
      "<y><noise type='gaussian'><stddev>0.01</stddev></noise></y>"
      "<z><noise type='gaussian'><stddev>0.01</stddev></noise></z></angular_velocity></imu></sensor>");
  EXPECT_EQ(imu.kind, "imu");
  EXPECT_EQ(imu.name, "nose");
  EXPECT_EQ(number_of(imu, "y"), 0.2);
  EXPECT_NEAR(number_of(imu, "yaw"), 1.5, 1e-15);
  EXPECT_EQ(number_of(imu, "turn_noise"), 0.01);
  EXPECT_EQ(number_of(imu, "noise"), 0);
}

TEST(SensorsOfFiles, ProgramsAreNamedByTheirTopics) {
  const auto names = [](const std::string& sensors) {
    std::vector<std::string> found;
    const LoadedWorld loaded = load_sensor(sensors);
    for (const ProgramRecord& record : loaded.world.bodies.at(0).programs) found.push_back(record.name);
    return found;
  };
  EXPECT_THAT(names("<sensor name='a' type='imu'><topic>/robot/front/imu</topic></sensor>"
                    "<sensor name='b' type='imu'><topic>other/imu</topic></sensor>"
                    "<sensor name='c' type='imu'/>"),
              ElementsAre("imu", "b", "c"));
  EXPECT_THAT(
      names("<sensor name='lds' type='ray'><plugin name='p' filename='libgazebo_ros_ray_sensor.so'><ros>"
            "<remapping>~/out:=scan</remapping></ros></plugin></sensor>"),
      ElementsAre("scan"));
  EXPECT_THAT(names("<sensor name='s' type='imu'><plugin name='p' filename='libgazebo_ros_imu_sensor.so'>"
                    "<topicName>/imu/data</topicName></plugin></sensor>"),
              ElementsAre("data"));
}

TEST(SensorsOfFiles, AnImuHasItsBiasAndItsDrift) {
  const ProgramRecord imu = program_of(
      "<sensor name='nose' type='imu'><imu><linear_acceleration><x><noise "
      "type='gaussian'><mean>0.1</mean><stddev>0.02"
      "</stddev><bias_mean>0.2</bias_mean><bias_stddev>0.003</bias_stddev><dynamic_bias_stddev>0.004"
      "</dynamic_bias_stddev><dynamic_bias_correlation_time>200</"
      "dynamic_bias_correlation_time><precision>0.01"
      "</precision></noise></x></linear_acceleration></imu></sensor>");
  EXPECT_NEAR(number_of(imu, "offset"), 0.3, 1e-15);
  EXPECT_EQ(number_of(imu, "bias"), 0.003);
  EXPECT_NEAR(number_of(imu, "drift"), 0.04, 1e-15);
  EXPECT_EQ(number_of(imu, "drift_time"), 200);
  EXPECT_EQ(number_of(imu, "precision"), 0.01);
  EXPECT_EQ(number_of(imu, "turn_bias"), 0);
}

TEST(SensorsOfFiles, ALidarHasItsRaysInRows) {
  const ProgramRecord lidar = program_of(
      "<sensor name='top' type='gpu_lidar'><update_rate>10</update_rate><lidar><scan>"
      "<horizontal><samples>64</samples><min_angle>-1</min_angle><max_angle>2</max_angle></horizontal>"
      "<vertical><samples>4</samples><min_angle>-0.2</min_angle><max_angle>0.1</max_angle></vertical></scan>"
      "<range><min>0.08</min><max>10</max></range>"
      "<noise><type>gaussian</type><stddev>0.02</stddev></noise></lidar></sensor>");
  EXPECT_EQ(lidar.kind, "ranger");
  EXPECT_EQ(number_of(lidar, "rays"), 64);
  EXPECT_EQ(number_of(lidar, "rows"), 4);
  EXPECT_EQ(number_of(lidar, "angle"), 3);
  EXPECT_EQ(number_of(lidar, "heading"), 0.5);
  EXPECT_NEAR(number_of(lidar, "elevation"), -0.05, 1e-15);
  EXPECT_NEAR(number_of(lidar, "row_angle"), 0.3, 1e-15);
  EXPECT_EQ(number_of(lidar, "least"), 0.08);
  EXPECT_EQ(number_of(lidar, "most"), 10);
  EXPECT_EQ(number_of(lidar, "noise"), 0.02);
  EXPECT_EQ(number_of(lidar, "rate"), 10);
}

TEST(SensorsOfFiles, ADepthCameraHasAsManyPixelsAsItMayHaveRays) {
  const LoadedWorld loaded = load_sensor(
      "<sensor name='eye' type='rgbd_camera'><pose>0.1 0 0.2 0 0 "
      "0</pose><update_rate>15</update_rate><camera>"
      "<horizontal_fov>1.2</horizontal_fov><image><width>640</width><height>480</height></"
      "image><clip><near>0.2</near>"
      "<far>8</far></clip></camera></sensor>");
  const ProgramRecord& camera = loaded.world.bodies.at(0).programs.at(0);
  EXPECT_EQ(camera.kind, "ranger");
  EXPECT_EQ(number_of(camera, "plane"), 1);
  EXPECT_EQ(number_of(camera, "rays"), 36);
  EXPECT_EQ(number_of(camera, "rows"), 27);
  EXPECT_EQ(number_of(camera, "angle"), 1.2);
  EXPECT_NEAR(number_of(camera, "row_angle"), 2 * std::atan(std::tan(0.6) * 0.75), 1e-12);
  EXPECT_EQ(number_of(camera, "most"), 8);
  EXPECT_THAT(loaded.notices,
              Contains("1 x <sensor> rgbd_camera: 640 x 480 pixels are thinned out to 36 x 27"));
}

TEST(SensorsOfFiles, ALidarOfTooManyRaysIsThinnedOut) {
  const LoadedWorld loaded = load_sensor(
      "<sensor name='top' type='ray'><ray><scan>"
      "<horizontal><samples>1800</samples><min_angle>-3.14</min_angle><max_angle>3.14</max_angle></"
      "horizontal>"
      "<vertical><samples>16</samples><min_angle>-0.2</min_angle><max_angle>0.2</max_angle></vertical></scan>"
      "<range><max>100</max></range></ray></sensor>");
  const ProgramRecord& lidar = loaded.world.bodies.at(0).programs.at(0);
  EXPECT_EQ(number_of(lidar, "rays"), 64);
  EXPECT_EQ(number_of(lidar, "rows"), 16);
  EXPECT_EQ(number_of(lidar, "angle"), 6.28);
  EXPECT_THAT(loaded.notices, Contains("1 x <sensor> ray: 28800 rays are thinned out to 1024"));
}

TEST(SensorsOfFiles, ASonarIsRaysInItsCone) {
  const ProgramRecord sonar = program_of(
      "<sensor name='s' type='sonar'><sonar><min>0.1</min><max>2</max><radius>2</radius></sonar></sensor>");
  EXPECT_EQ(sonar.kind, "ranger");
  EXPECT_NEAR(number_of(sonar, "angle"), std::numbers::pi / 2, 1e-15);
  EXPECT_EQ(number_of(sonar, "most"), 2);
}

TEST(SensorsOfFiles, SatellitesAndBarometersKnowWhereTheWorldIs) {
  const std::string zurich =
      "<spherical_coordinates><latitude_deg>47.4</latitude_deg><longitude_deg>8.5</longitude_deg>"
      "<elevation>500</elevation><heading_deg>90</heading_deg></spherical_coordinates>";
  const ProgramRecord receiver = program_of("<sensor name='s' type='navsat'/>", zurich);
  EXPECT_EQ(receiver.kind, "satellite");
  EXPECT_EQ(number_of(receiver, "latitude"), 47.4);
  EXPECT_EQ(number_of(receiver, "longitude"), 8.5);
  EXPECT_EQ(number_of(receiver, "height"), 500);
  EXPECT_EQ(number_of(receiver, "heading"), -90);
  EXPECT_EQ(number_of(receiver, "from_x"), 1);
  EXPECT_EQ(number_of(receiver, "from_z"), 3);
  const ProgramRecord barometer = program_of(
      "<sensor name='s' type='air_pressure'><air_pressure><reference_altitude>100</reference_altitude>"
      "</air_pressure></sensor>");
  EXPECT_EQ(number_of(barometer, "height"), 103);
}

TEST(SensorsOfFiles, AMagnetometerHasTheFieldOfItsWorld) {
  const ProgramRecord magnetometer = program_of("<sensor name='s' type='magnetometer'/>",
                                                "<magnetic_field>1e-5 2e-5 -3e-5</magnetic_field>");
  EXPECT_EQ(magnetometer.kind, "magnetometer");
  EXPECT_EQ(number_of(magnetometer, "field_z"), -3e-5);
}

TEST(SensorsOfFiles, ForceAndTorqueAreMeasuredInTheChild) {
  const LoadedWorld loaded = load(world(
      "<model name='m'><link name='a'>" + kUnitBox + "</link><link name='b'><pose>0 0 2 0 0 0</pose>" +
      kUnitBox +
      "</link><joint name='j' type='revolute'><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz></axis>"
      "<sensor name='wrist' type='force_torque'><force_torque><measure_direction>parent_to_child"
      "</measure_direction></force_torque></sensor></joint></model>"));
  const ProgramRecord& load = loaded.world.bodies.at(1).programs.at(0);
  EXPECT_EQ(load.kind, "load");
  EXPECT_EQ(load.name, "wrist");
  EXPECT_EQ(number_of(load, "joint"), 1);
  EXPECT_EQ(number_of(load, "frame"), 1);
  EXPECT_EQ(number_of(load, "direction"), 1);
}

TEST(SensorsOfFiles, WhateverANoiseHasIsThatOfTheProgram) {
  const std::string noise =
      "<noise type='gaussian'><mean>0.1</mean><stddev>0.2</stddev><bias_mean>0.3</bias_mean><bias_stddev>0.4"
      "</bias_stddev><dynamic_bias_stddev>0.5</dynamic_bias_stddev><dynamic_bias_correlation_time>8"
      "</dynamic_bias_correlation_time><precision>0.6</precision></noise>";
  const std::string axes = "<x>" + noise + "</x><y>" + noise + "</y><z>" + noise + "</z>";
  struct Case {
    std::string sensor;
    std::vector<std::string> numbers;  // what is before their names
  };
  for (const auto& [sensor, numbers] :
       {Case{"altimeter'><altimeter><vertical_position>" + noise + "</vertical_position><vertical_velocity>" +
                 noise + "</vertical_velocity></altimeter>",
             {"", "climb_"}},
        Case{"air_pressure'><air_pressure><pressure>" + noise + "</pressure></air_pressure>", {""}},
        Case{"magnetometer'><magnetometer>" + axes + "</magnetometer>", {""}},
        Case{"navsat'><navsat><position_sensing><horizontal>" + noise + "</horizontal><vertical>" + noise +
                 "</vertical></position_sensing><velocity_sensing><horizontal>" + noise +
                 "</horizontal></velocity_sensing></navsat>",
             {"", "height_", "velocity_"}}}) {
    const LoadedWorld loaded = load_sensor("<sensor name='s' type='" + sensor + "</sensor>");
    const ProgramRecord& record = loaded.world.bodies.at(0).programs.at(0);
    for (const std::string& first : numbers) {
      SCOPED_TRACE(record.kind + ": " + first);
      EXPECT_EQ(number_of(record, first + "noise"), 0.2);
      EXPECT_EQ(number_of(record, first + "offset"), 0.4);
      EXPECT_EQ(number_of(record, first + "bias"), 0.4);
      EXPECT_EQ(number_of(record, first + "drift"), 1) << "in the long run";
      EXPECT_EQ(number_of(record, first + "drift_time"), 8);
      EXPECT_EQ(number_of(record, first + "precision"), 0.6);
    }
    EXPECT_THAT(loaded.notices, Not(Contains(HasSubstr("not simulated"))));
  }
}

TEST(SensorsOfFiles, ACameraHasItsLensAndNoImages) {
  const LoadedWorld loaded = load_sensor(
      "<sensor name='eye' type='camera'><topic>/robot/left/image_raw</topic><pose>0.1 0 0.2 0 0.5 0</pose>"
      "<update_rate>30</update_rate><camera><horizontal_fov>1.2</horizontal_fov><image><width>640</width>"
      "<height>480</height></image><distortion><k1>-0.25</k1><p2>0.01</p2></distortion><lens><intrinsics>"
      "<fx>554</fx><fy>555</fy><cx>320.5</cx><cy>240.5</cy></intrinsics></lens></camera></sensor>");
  const ProgramRecord& camera = loaded.world.bodies.at(0).programs.at(0);
  EXPECT_EQ(camera.kind, "camera");
  EXPECT_EQ(camera.name, "left");
  for (const auto& [name, value] : {std::pair{"x", 0.1},
                                    {"z", 0.2},
                                    {"pitch", 0.5},
                                    {"rate", 30.0},
                                    {"width", 640.0},
                                    {"height", 480.0},
                                    {"angle", 1.2},
                                    {"focal_y", 555.0},
                                    {"centre_x", 320.5},
                                    {"k1", -0.25},
                                    {"p2", 0.01}})
    EXPECT_NEAR(number_of(camera, name), value, 1e-15) << name;
  EXPECT_THAT(loaded.notices, Contains("1 x <sensor> camera is the program camera"));
  EXPECT_THAT(loaded.notices, Contains("1 x <sensor> camera: images not simulated"));
}

TEST(SensorsOfFiles, ALogicalCameraSeesByATrigger) {
  const auto camera = [](const std::string& far) {
    return load_sensor(
        "<sensor name='s' type='logical_camera'><pose>0.5 0 0 0 0 "
        "0</pose><logical_camera><near>0.5</near><far>" +
        far +
        "</far><horizontal_fov>1.04</horizontal_fov><aspect_ratio>1.5</aspect_ratio></logical_camera></"
        "sensor>");
  };
  const LoadedWorld loaded = camera("5");
  const ProgramRecord& record = loaded.world.bodies.at(0).programs.at(0);
  EXPECT_EQ(record.kind, "logical_camera");
  for (const auto& [name, value] :
       {std::pair{"x", 0.5}, {"near", 0.5}, {"far", 5.0}, {"angle", 1.04}, {"aspect", 1.5}})
    EXPECT_EQ(number_of(record, name), value) << name;
  EXPECT_FALSE(loaded.world.bodies.at(0).properties.trigger) << "only its view is one";
  EXPECT_THAT(camera("500").repairs, Contains(HasSubstr("be at most 100 m across")));
}

TEST(SensorsOfFiles, CamerasTakeNoPlaceFromWhatMeasures) {
  std::string sensors;
  for (const char* type : {"camera", "camera", "camera", "imu", "imu", "imu", "imu", "imu"})
    sensors += std::string("<sensor name='s' type='") + type + "'/>";
  const LoadedWorld loaded = load_sensor(sensors);
  std::vector<std::string> kinds;
  for (const ProgramRecord& record : loaded.world.bodies.at(0).programs) kinds.push_back(record.kind);
  EXPECT_THAT(kinds, ElementsAre("imu", "imu", "imu", "imu", "imu", "camera"));
  EXPECT_THAT(loaded.notices, Contains("2 x camera of a link that has 6 programs already, left out"));
}

TEST(SensorsOfFiles, WhatIsNotMeasuredIsNamed) {
  const LoadedWorld loaded = load_sensor(
      "<sensor name='eye' type='rfid'/><sensor name='s' type='altimeter'><altimeter><vertical_position>"
      "<noise "
      "type='gaussian'><stddev>1</stddev><bias_mean>2</bias_mean></noise></vertical_position></altimeter>"
      "</sensor><sensor name='t' type='sonar'><sonar><noise><stddev>1</stddev><mean>2</mean></noise></sonar>"
      "</sensor>");
  EXPECT_THAT(loaded.notices, Contains("1 x <sensor> rfid skipped"));
  EXPECT_THAT(loaded.notices, Contains("1 x <sensor> altimeter is the program altimeter"));
  EXPECT_THAT(loaded.notices, Contains("1 x <sensor> sonar: <mean> of noise not simulated"));
}

TEST(SensorsOfFiles, OneWithANumberOutOfBoundsIsLeftOut) {
  const LoadedWorld loaded =
      load_sensor("<sensor name='s' type='ray'><ray><range><max>-3</max></range></ray></sensor>");
  EXPECT_THAT(loaded.world.bodies.at(0).programs, IsEmpty());
  EXPECT_THAT(loaded.repairs, Contains(HasSubstr("<sensor> ray, left out: most = -3 m must be")));
}

TEST(SensorsOfFiles, ThoseThatNeverMoveStandOnABodyOfTheirOwn) {
  const std::string sensors =
      "<sensor name='s' type='imu'/><sensor name='feet' type='contact'/><sensor name='eye' type='lidar'/>";
  const LoadedWorld loaded = load(world(
      model("m", "<static>true</static><pose>1 2 3 0 0 1</pose>", kUnitBox + sensors) + model("other", "")));
  ASSERT_EQ(loaded.world.bodies.size(), 3u);
  EXPECT_THAT(loaded.world.bodies[0].programs, IsEmpty());
  EXPECT_EQ(loaded.world.bodies[0].properties.motion, Motion::kStatic);
  const BodyDescription& stand = loaded.world.bodies[2];
  EXPECT_EQ(stand.name, "m::l::sensors");
  EXPECT_EQ(stand.properties.motion, Motion::kKinematic);
  EXPECT_EQ(stand.properties.category, 0u) << "nothing touches it";
  EXPECT_EQ(stand.pose.position, loaded.world.bodies[0].pose.position);
  EXPECT_TRUE(stand.pose.orientation.isApprox(loaded.world.bodies[0].pose.orientation));
  ASSERT_EQ(stand.programs.size(), 3u);
  EXPECT_EQ(stand.programs[0].kind, "imu");
  for (const std::size_t of_link : {1, 2})
    EXPECT_EQ(number_of(stand.programs[of_link], "body"), 1) << of_link;
  EXPECT_TRUE(check_programs(loaded.world).ok()) << check_programs(loaded.world);
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("link that does not move has sensors")));
}

TEST(SensorsOfFiles, ALinkThatNeverMovesNeedsNoCollisionForThem) {
  const LoadedWorld loaded =
      load(world("<model name='m'><static>true</static><link name='l'><sensor name='s' "
                 "type='lidar'/></link></model>"));
  ASSERT_EQ(loaded.world.bodies.size(), 1u);
  EXPECT_EQ(loaded.world.bodies[0].name, "m::l::sensors");
  EXPECT_EQ(number_of(loaded.world.bodies[0].programs.at(0), "body"), 0);
}

TEST(SensorsOfFiles, ALogicalCameraThatNeverMovesLooksIntoTheTriggerOfItsLink) {
  const LoadedWorld loaded =
      load(world("<model name='m'><static>true</static><link name='l'><sensor name='s' type='logical_camera'>"
                 "<logical_camera><far>4</far></logical_camera></sensor></link></model>"));
  ASSERT_EQ(loaded.world.bodies.size(), 2u);
  EXPECT_EQ(number_of(loaded.world.bodies[1].programs.at(0), "body"), 1);
}

TEST(SensorsOfFiles, ThoseOfAUrdfLinkOnAFixedJointAreWhereTheyWere) {
  const Folder folder;
  const LoadedWorld loaded =
      load_world_file(
          folder.write(
              "robot.urdf",
              "<robot name='r'><link name='base'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' "
              "ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry><box size='1 1 1'/></geometry>"
              "</collision></link><link name='mast'/><joint name='j' type='fixed'><parent link='base'/>"
              "<child link='mast'/><origin xyz='0 0 0.5' rpy='0 0 0'/></joint><gazebo reference='mast'>"
              "<sensor name='top' type='ray'><pose>0.1 0 0 0 0 0</pose></sensor></gazebo></robot>") /
          "robot.urdf")
          .value();
  ASSERT_EQ(loaded.world.bodies.size(), 1u);
  const ProgramRecord& lidar = loaded.world.bodies[0].programs.at(0);
  EXPECT_EQ(lidar.name, "top");
  EXPECT_EQ(number_of(lidar, "x"), 0.1);
  EXPECT_EQ(number_of(lidar, "z"), 0.5);
}

}  // namespace
}  // namespace tessera
