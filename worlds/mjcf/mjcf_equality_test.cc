// Worlds of MuJoCo's files are those that MuJoCo makes of them.
#include <absl/strings/str_cat.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <set>
#include <vector>

#include "lpss/simulation/simulation.h"
#include "worlds/mjcf/mujoco_for_tests.h"

namespace tessera::mjcf {
namespace {

using Eigen::Vector3d;

void expect_same(const std::string& text, const std::filesystem::path& folder) {
  const Both both(text, folder);
  if (both.model == nullptr) return;
  expect_same_motion(both);
  expect_same_masses(both);
  expect_same_joints(both);
}

// All kinds of joints, with references, anchors, welded bodies and turned frames.
constexpr char kMechanism[] = R"(
<mujoco model="m">
  <compiler angle="degree" eulerseq="zyx"/>
  <worldbody>
    <body name="base" pos="1 2 3" euler="10 20 30">
      <geom type="box" size=".2 .3 .1"/>
      <body name="arm" pos=".3 .1 0" euler="0 40 0">
        <joint name="shoulder" axis="1 2 .5" pos="-.1 .05 0" ref="30" range="-20 70"/>
        <geom type="capsule" size=".05" fromto="0 0 0 .4 .1 .2"/>
        <body name="fixed" pos=".4 0 0" quat="1 .2 .3 .1">
          <geom type="ellipsoid" size=".1 .2 .05"/>
          <body name="wrist" pos="0 .2 0">
            <joint name="pan" axis="0 0 1" ref="-15"/>
            <joint name="tilt" axis="0 1 0" ref="25"/>
            <geom type="cylinder" size=".1 .05" pos=".1 0 0"/>
            <body name="tool" euler="5 0 0">
              <joint name="out" type="slide" axis="0 1 1" ref=".2" range="-.1 .4"/>
              <joint name="spin" axis="0 1 0" pos="0 0 .1"/>
              <joint name="roll" axis="1 0 0"/>
              <geom type="sphere" size=".07" pos="0 .1 0"/>
              <body name="ball" pos="0 .3 0"><joint name="ball" type="ball" pos="0 -.1 0"/><geom size=".04"/></body>
            </body>
          </body>
        </body>
      </body>
    </body>
    <body name="drone" pos="0 0 5" euler="0 90 0"><freejoint/><geom type="box" size=".1 .2 .3" pos=".1 0 0"/></body>
  </worldbody>
  %s
</mujoco>)";

std::string mechanism(const std::string& more) {
  std::string text = kMechanism;
  return text.replace(text.find("%s"), 2, more);
}

TEST(MjcfEquality, AMechanismStandsAndWeighsAsInMujoco) { expect_same(mechanism(""), "/"); }

TEST(MjcfEquality, AMechanismMovesAsInItsKeyframe) {
  expect_same(mechanism("<keyframe><key name='home' qpos='.2 -.7 .4 .1 1 -1.5 .5 .5 -.5 .5 1 2 3 1 0 .5 .2' "
                        "qvel='1 2 3 4 5 6 0 0 0 1 2 3 4 5 6'/></keyframe>"),
              "/");
}

TEST(MjcfEquality, FilesOfOthersStandAndWeighAsInMujoco) {
  const char* const folder = std::getenv("TESSERA_WORLDS");
  if (folder == nullptr) GTEST_SKIP() << "TESSERA_WORLDS is not set";
  const std::filesystem::path files = std::filesystem::path(folder) / "mujoco";
  if (!std::filesystem::exists(files)) GTEST_SKIP() << files << " is not there";
  int compared = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(files)) {
    if (entry.path().extension() != ".xml" || !load_world_file(entry.path()).ok()) continue;
    SCOPED_TRACE(entry.path().string());
    std::ifstream stream(entry.path());
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    expect_same(text, entry.path().parent_path());
    ++compared;
  }
  RecordProperty("files", compared);
}

// Two rods that swing from the side: MuJoCo by RK4, and ours in many small ticks.
constexpr char kPendulum[] = R"(
<mujoco model="m">
  <option timestep="1e-4" integrator="RK4"/>
  <worldbody>
    <body name="upper">
      <joint name="a" axis="0 1 0" damping=".01"/>
      <geom type="capsule" size=".02" fromto="0 0 0 .5 0 0" mass="1"/>
      <body name="lower" pos=".5 0 0">
        <joint name="b" axis="0 1 0" stiffness=".2" springref="30"/>
        <geom type="capsule" size=".02" fromto="0 0 0 .4 0 0" mass=".5"/>
      </body>
    </body>
  </worldbody>
</mujoco>)";

TEST(MjcfEquality, APendulumSwingsAsInMujoco) {
  const Both both(kPendulum, "/");
  ASSERT_NE(both.model, nullptr);
  WorldDescription world = both.loaded.world;
  world.settings.precision = Precision::kFloat64;
  const auto simulation = Simulation::create(world);
  ASSERT_TRUE(simulation.ok()) << simulation.status();
  for (int n = 0; n < 10'000; ++n) {
    (*simulation)->step();
    mj_step(both.model->its.get(), both.data.get());
  }
  mj_kinematics(both.model->its.get(), both.data.get());
  mj_comPos(both.model->its.get(), both.data.get());
  (*simulation)->for_each_body([&](const BodyRecord& body) {
    const int theirs = static_cast<int>(body.id.value);  // both begin to count at the world
    const Vector3d centre = vector_at(both.data->xipos + 3 * theirs);
    expect_near(Vector3d(body.state.position.data()), centre, 1e-4);
    EXPECT_LT(centre.x(), 0.2);  // they did swing
  });
}

// Whether bits let a pair collide.
bool collide(const ContactBits& a, const ContactBits& b) {
  return (a.category & b.mask) != 0 && (b.category & a.mask) != 0;
}

std::string world_by_chance(std::mt19937& chance, int bodies) {
  const auto number = [&](int most) { return static_cast<int>(chance() % static_cast<unsigned>(most + 1)); };
  std::string text = "<mujoco><worldbody>";
  for (int n = 0; n < bodies; ++n) {
    absl::StrAppend(&text, "<body name='b", n, "'><freejoint/><geom name='g", n, "' size='1' contype='",
                    number(3), "' conaffinity='", number(3), "'/></body>");
  }
  absl::StrAppend(&text, "</worldbody><contact>");
  std::set<std::pair<int, int>> used;
  for (int n = 0; n < 4; ++n) {
    const std::pair<int, int> pair = std::minmax(number(bodies - 1), number(bodies - 1));
    if (pair.first == pair.second || !used.insert(pair).second) continue;
    if (n < 3) {
      absl::StrAppend(&text, "<exclude body1='b", pair.first, "' body2='b", pair.second, "'/>");
    } else {
      absl::StrAppend(&text, "<pair geom1='g", pair.first, "' geom2='g", pair.second, "'/>");
    }
  }
  return text + "</contact></mujoco>";
}

TEST(MjcfEquality, BitsLetThosePairsCollideThatCollideInMujoco) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  std::mt19937 chance(seed);
  for (int round = 0; round < 100; ++round) {
    const std::string text = world_by_chance(chance, 8);
    SCOPED_TRACE(text);
    auto file = xml::File::parse(text, "<string>", "/");
    ASSERT_TRUE(file.ok()) << file.status();
    Notices notices;
    const auto model = compile(**file, notices);
    ASSERT_TRUE(model.ok()) << model.status();
    const mjModel& its = **model;
    std::vector<int> carriers;
    for (int body = 0; body < its.nbody; ++body) carriers.push_back(body);
    Apart apart;
    for (int n = 0; n < its.nexclude; ++n)
      apart.insert(
          std::minmax((its.exclude_signature[n] >> 16) - 1, (its.exclude_signature[n] & 0xffff) - 1));
    const std::vector<ContactBits> bits = contact_bits(its, carriers, apart, notices);
    for (int a = 0; a < its.ngeom; ++a) {
      for (int b = a + 1; b < its.ngeom; ++b) {
        const auto is_pair = [&](int n) {
          return std::minmax(its.pair_geom1[n], its.pair_geom2[n]) == std::minmax(a, b);
        };
        bool expected = !apart.contains(std::minmax(its.geom_bodyid[a], its.geom_bodyid[b])) &&
                        ((its.geom_contype[a] & its.geom_conaffinity[b]) != 0 ||
                         (its.geom_contype[b] & its.geom_conaffinity[a]) != 0);
        for (int n = 0; n < its.npair; ++n) expected = expected || is_pair(n);
        EXPECT_EQ(collide(bits[static_cast<std::size_t>(a)], bits[static_cast<std::size_t>(b)]), expected)
            << a << " and " << b;
      }
    }
    // With bodies of other files, geoms collide as with MuJoCo's defaults.
    for (int a = 0; a < its.ngeom; ++a) {
      const bool expected = ((its.geom_contype[a] | its.geom_conaffinity[a]) & 1) != 0;
      EXPECT_EQ(collide(bits[static_cast<std::size_t>(a)], {1, 0xffffffff}), expected) << a;
    }
  }
}

TEST(MjcfEquality, AFileOfDefaultsHasTheBitsOfOurOwn) {
  auto file = xml::File::parse("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>", "<string>", "/");
  Notices notices;
  const auto model = compile(**file, notices);
  ASSERT_TRUE(model.ok());
  const std::vector<ContactBits> bits = contact_bits(**model, {0}, {}, notices);
  EXPECT_EQ(bits.front().category, 1u);
  EXPECT_EQ(bits.front().mask, 0xffffffff);
}

}  // namespace
}  // namespace tessera::mjcf
