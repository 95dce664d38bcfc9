// What happens in frames that move, beside what is seen from where nothing turns or brakes.
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <numbers>

#include "experiments/truth/scene_parts.h"
#include "lpss/base/rotation.h"
#include "lpss/model/frame_keys.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;

Scene frame_scene(const std::string& name, double seconds) {
  return scene_without_bullet("frames", name, seconds);
}

// All of it in a frame at 7.8 km/s.
WorldDescription in_orbit(const WorldDescription& world, const Vector3d& spin = Vector3d::Zero(),
                          const std::vector<FrameLeg>& legs = {}) {
  MovingFrame frame;
  frame.name = "frame";
  frame.velocity = {7800, 0, 0};
  frame.spin = spin;
  frame.legs = legs;
  return aboard(frame, world);
}

// --- a wheel in space, that turns about y ---

constexpr double kSpin = 0.3;            // rad/s
constexpr double kEarthSpin = 7.292e-5;  // rad/s

Vector3d to_frame(const Vector3d& outside, double time) {
  return rotation_by(Vector3d(0, -kSpin * time, 0)) * outside;
}

Scene flies_in_a_habitat(const std::string& name, const Vector3d& velocity) {
  Scene scene = frame_scene(name, 3);
  const Vector3d start(kPlace, 1, -50);
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    add_body(builder, "ball", Sphere{0.2}, 1, start, 0.5).linear_velocity = velocity;
    return in_orbit(builder.world(), {0, kSpin, 0});
  };
  scene.results = [=](const Course& course) -> Results {
    const double time = static_cast<double>(course.ticks()) * course.dt();
    const Vector3d outside = velocity + Vector3d(0, kSpin, 0).cross(start);
    const Vector3d right = to_frame(start + outside * time, time);
    const Vector3d speed = to_frame(outside, time) - Vector3d(0, kSpin, 0).cross(right);
    const Glance& end = course.last("ball");
    return {{"off its place", "m", 0, (end.place - right).norm(), 2e-3},
            {"off its velocity", "m/s", 0, (end.velocity - speed).norm(), 2e-3}};
  };
  return scene;
}

// What stands on a floor at R bears m w^2 R, and rolls as on a slope that leans by how far it is from below
// the axis.
Scene slides_in_a_habitat() {
  constexpr double kRim = 100;
  constexpr double kFriction = 0.2;
  constexpr double kSpeed = 3;  // across, along the axis: no Coriolis force
  Scene scene = frame_scene("slides_in_a_habitat", 3);
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    builder.add("floor", builder.shape(Box{{40, 40, 1}}), 1, {0, 0, -kRim - 0.5}, Motion::kStatic)
        .properties.friction = kFriction;
    add_body(builder, "box", Box{{0.5, 0.5, 0.2}}, 10, {0, -4, -kRim + 0.1}, kFriction).linear_velocity = {
        0, kSpeed, 0};
    return in_orbit(builder.world(), {0, kSpin, 0});
  };
  scene.results = [=](const Course& course) -> Results {
    const double pressed = kSpin * kSpin * (kRim - 0.1);
    const double way = kSpeed * kSpeed / (2 * kFriction * pressed);
    const Vector3d went = course.last("box").place - course.first("box").place;
    return {{"way", "m", way, went.y(), 0.01 * way}, {"aside", "m", 0, went.x(), 0.01}};
  };
  return scene;
}

// At rest outside, for an hour: in the habitat, it goes round the axis 172 times.
Scene circles_for_an_hour() {
  constexpr double kCircle = 50;
  static const Vector3d kOnCircle(kCircle, 1, 0);
  Scene scene = frame_scene("circles_for_an_hour", 3600);
  scene.has_border = false;
  scene.every = 60;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    add_body(builder, "ball", Sphere{0.2}, 1, kOnCircle, 0.5).linear_velocity =
        -Vector3d(0, kSpin, 0).cross(kOnCircle);
    return in_orbit(builder.world(), {0, kSpin, 0});
  };
  scene.results = [](const Course& course) -> Results {
    const Glance& end = course.last("ball");
    const Vector3d right = to_frame(kOnCircle, course.seconds());
    const double speed = kSpin * kCircle;
    return {{"radius", "m", kCircle, Vector3d(end.place.x(), 0, end.place.z()).norm(), 1e-3 * kCircle},
            {"off its place", "m", 0, (end.place - right).norm(), 0.5},
            {"speed", "m/s", speed, end.velocity.norm(), 1e-3 * speed}};
  };
  return scene;
}

// At a latitude, the plane of a pendulum turns by -w sin(latitude) t: here at the pole.
Scene foucault(const std::string& name, double turn, double seconds) {
  constexpr double kLength = 10;  // m
  constexpr double kWide = 0.5;   // m
  Scene scene = frame_scene(name, seconds);
  scene.has_border = false;
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    BodyDescription& bob = add_body(builder, "bob", Sphere{0.1}, 10,
                                    {kWide, 0, -std::sqrt(kLength * kLength - kWide * kWide)}, 0.5);
    // At rest outside: else it would go round.
    bob.linear_velocity = -Vector3d(0, 0, turn).cross(Vector3d(kWide, 0, 0));
    bob.angular_velocity = {0, 0, -turn};
    builder.tie("wire", JointType::kBall, "", "bob", {0, 0, 0});
    return in_orbit(builder.world(), {0, 0, turn});
  };
  scene.results = [=](const Course& course) -> Results {
    // The line of the last half period, through its two ends.
    const double period = 2 * std::numbers::pi * std::sqrt(kLength / kGravity);
    const std::span<const Glance> all = course.between("bob", seconds - period, seconds);
    const auto farthest =
        std::ranges::max_element(all, {}, [](const Glance& g) { return g.place.head<2>().norm(); });
    const double time = seconds - period + static_cast<double>(farthest - all.begin()) * course.dt();
    const double angle = std::atan2(farthest->place.y(), farthest->place.x());
    const double off = std::remainder(angle + turn * time, std::numbers::pi);
    return {{"direction", "degrees", 0, off * 180 / std::numbers::pi,
             0.01 * turn * time * 180 / std::numbers::pi},
            {"width", "m", kWide, farthest->place.head<2>().norm(), 0.01 * kWide}};
  };
  return scene;
}

// A train that brakes by more than friction holds: the way until boxes stand again.
Scene brakes(const std::string& name, double braking) {
  constexpr double kFriction = 0.25;
  constexpr double kSeconds = 2;
  Scene scene = frame_scene(name, 6);
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, {0, 0, -kGravity}), kFriction);
    add_body(builder, "box", Box{{0.8, 0.6, 0.2}}, 10, {kPlace, 0, 0.1}, kFriction);
    return in_orbit(builder.world(), Vector3d::Zero(), {{1, Vector3d::Zero()}, {kSeconds, {-braking, 0, 0}}});
  };
  scene.results = [=](const Course& course) -> Results {
    const double held = kFriction * kGravity;
    const double past = std::max(braking - held, 0.0);
    const double speed = past * kSeconds;
    const double way = speed * kSeconds / 2 + speed * speed / (2 * held);
    return {
        {"way", "m", way, course.last("box").place.x() - course.first("box").place.x(), 0.01 * way + 1e-3}};
  };
  return scene;
}

// --- along keys ---

// From rest to rest in so many seconds: how far it is, of 1, and its derivatives.
struct Eased {
  double share;
  double rate;
  double second;
  Eased(double time, double seconds) {
    const double s = time / seconds;
    share = s * s * (3 - 2 * s);
    rate = 6 * s * (1 - s) / seconds;
    second = (6 - 12 * s) / (seconds * seconds);
  }
};

// Two keys make a path, from the first of which on bodies are aboard.
WorldDescription between_keys(const WorldDescription& world, double seconds, const Vector3d& way,
                              const Vector3d& turn) {
  MovingFrame frame;
  frame.name = "frame";
  frame.keys = {{0, {}, {}, {}}, {seconds, {way, rotation_by(turn)}, {}, {}}};
  smooth_keys(frame.keys, frame.loops);
  return aboard(frame, world);
}

// A ship that turns while it speeds up and slows down: seen from outside, a ball aboard flies on a parabola.
Scene thrown_along_keys() {
  constexpr double kSeconds = 4;
  static const Vector3d kWay(30, -10, 20);
  static constexpr double kTurn = 2;  // rad, about y
  static const Vector3d kVelocity(4, -1, 7);
  Scene scene = frame_scene("thrown_along_keys", 3);
  const Vector3d start(kPlace, 1, -20);
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_body(builder, "ball", Sphere{0.2}, 1, start, 0.5).linear_velocity = kVelocity;
    return between_keys(builder.world(), kSeconds, kWay, {0, kTurn, 0});
  };
  scene.results = [=](const Course& course) -> Results {
    const double time = static_cast<double>(course.ticks()) * course.dt();
    const Eased ease(time, kSeconds);
    const auto back = rotation_by(Vector3d(0, -kTurn * ease.share, 0));
    const Vector3d outside = start + kVelocity * time - Vector3d(0, 0, kGravity * time * time / 2);
    const Vector3d right = back * Vector3d(outside - kWay * ease.share);
    const Vector3d speed = back * Vector3d(kVelocity - Vector3d(0, 0, kGravity * time) - kWay * ease.rate) -
                           Vector3d(0, kTurn * ease.rate, 0).cross(right);
    const Glance& end = course.last("ball");
    return {{"off its place", "m", 0, (end.place - right).norm(), 2e-3},
            {"off its velocity", "m/s", 0, (end.velocity - speed).norm(), 2e-3}};
  };
  return scene;
}

// Under acceleration that falls evenly from `a` to `-a`, a box slides back until friction has stopped it,
// stays until friction holds it no more, and slides forward until some time after the stop.
Scene slides_along_keys() {
  constexpr double kFriction = 0.25;
  constexpr double kSeconds = 4;
  constexpr double kWay = 16;  // m
  Scene scene = frame_scene("slides_along_keys", 6);
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, {0, 0, -kGravity}), kFriction);
    add_body(builder, "box", Box{{0.8, 0.6, 0.2}}, 10, {kPlace, 0, 0.1}, kFriction);
    return between_keys(builder.world(), kSeconds, {kWay, 0, 0}, Vector3d::Zero());
  };
  scene.results = [=](const Course& course) -> Results {
    const double most = Eased(0, kSeconds).second * kWay;
    const double held = kFriction * kGravity;
    const double stops = kSeconds * (1 - held / most);
    const double back = stops * stops * ((most - held) / 2 - most * stops / (3 * kSeconds));
    const double slides = kSeconds - kSeconds / 2 * (1 + held / most);
    const double speed = most / kSeconds * slides * slides;
    const double forward = speed * slides / 3 + speed * speed / (2 * held);
    const double from = course.first("box").place.x();
    return {{"way back", "m", back, from - course.at("box", stops + 0.1).place.x(), 0.01 * back},
            {"way", "m", forward - back, course.last("box").place.x() - from, 0.01 * back}};
  };
  return scene;
}

// --- a ship that carries a frame ---

// A hull in space without gravity, pushed along x, and what is aboard, where places are from its centre.
WorldDescription with_ship(const WorldSettings& settings, double mass, double thrust,
                           const std::function<void(WorldBuilder&)>& fill) {
  WorldBuilder inside(with_gravity(settings, Vector3d::Zero()));
  fill(inside);
  MovingFrame frame;
  frame.name = "aboard";
  frame.carrier = FrameCarrier{BodyId{inside.world().bodies.size() + 1}, {}};
  WorldBuilder builder(inside.world().settings);
  builder.world() = aboard(frame, inside.world());
  BodyDescription& hull = add_body(builder, "hull", Box{{4, 2, 2}}, mass, {kPlace, 0, 0}, 0.5);
  hull.linear_velocity = {20, 0, 0};
  if (thrust != 0) hull.properties.lasting = LastingForce{{{thrust, 0, 0}, {}}};
  place_carried(builder.world());
  return builder.world();
}

// Over the deck of a hull that goes straight on in the habitat, and carries a frame: a ball flies as it would
// without both.
Scene thrown_aboard_in_a_habitat() {
  static const Vector3d kHullAt(kPlace, 1, -50);
  static const Vector3d kCourse(2, 0.5, 1);     // m/s, in the habitat
  static const Vector3d kThrownAt(1, 0, 2);     // m, in the frame of the hull
  static const Vector3d kVelocity(-1, 0.5, 4);  // m/s, likewise
  Scene scene = frame_scene("thrown_aboard_in_a_habitat", 3);
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    BodyDescription& hull =
        builder.add("hull", builder.shape(Box{{6, 3, 1}}), 1000, kHullAt, Motion::kKinematic);
    hull.linear_velocity = kCourse;
    add_body(builder, "ball", Sphere{0.2}, 1, kThrownAt, 0.5).linear_velocity = kVelocity;
    WorldDescription world = in_orbit(builder.world(), {0, kSpin, 0});
    MovingFrame deck;
    deck.name = "deck";
    deck.carrier = FrameCarrier{BodyId{1}, {}};
    world.settings.frames.push_back(deck);
    world.bodies[1].pose.position = *canonical({0, 0, 0, 2}, kThrownAt, settings.sector_size);
    place_carried(world);
    return world;
  };
  scene.results = [](const Course& course) -> Results {
    const double time = static_cast<double>(course.ticks()) * course.dt();
    const Vector3d outside = kVelocity + kCourse + Vector3d(0, kSpin, 0).cross(kHullAt + kThrownAt);
    const Vector3d in_habitat = to_frame(kHullAt + kThrownAt + outside * time, time);
    const Vector3d speed = to_frame(outside, time) - Vector3d(0, kSpin, 0).cross(in_habitat) - kCourse;
    const Glance& end = course.last("ball");
    return {{"off its place", "m", 0, (end.place - (in_habitat - kHullAt - kCourse * time)).norm(), 2e-3},
            {"off its velocity", "m/s", 0, (end.velocity - speed).norm(), 2e-3}};
  };
  return scene;
}

void add_wall(WorldBuilder& builder, double x) {
  builder.add("wall", builder.shape(Box{{1, 8, 8}}), 1, {x, 0, 0}, Motion::kStatic);
}

// Both together are pushed, whichever is heavier.
Scene thrust_with_cargo(const std::string& name, double cargo) {
  constexpr double kHull = 1000;
  constexpr double kThrust = 2000;  // N
  Scene scene = frame_scene(name, 4);
  scene.world = [=](const WorldSettings& settings) {
    return with_ship(settings, kHull, kThrust, [=](WorldBuilder& builder) {
      add_wall(builder, -1.5);
      add_body(builder, "cargo", Box{{1, 1, 1}}, cargo, {-0.5, 0, 0}, 0.5);
    });
  };
  scene.results = [=](const Course& course) -> Results {
    const double time = static_cast<double>(course.ticks()) * course.dt();
    const double right = kThrust * time / (kHull + cargo);
    const double gained = course.last("hull").velocity.x() - course.first("hull").velocity.x();
    return {{"velocity", "m/s", right, gained, 0.02 * right},
            {"cargo off its place", "m", 0, (course.last("cargo").place - course.first("cargo").place).norm(),
             2e-3}};
  };
  return scene;
}

// Somebody flies to the bow and stops there.
Scene crew_to_the_bow() {
  constexpr double kHull = 1000;
  constexpr double kCrew = 80;
  Scene scene = frame_scene("crew_to_the_bow", 6);
  scene.world = [=](const WorldSettings& settings) {
    return with_ship(settings, kHull, 0, [](WorldBuilder& builder) {
      add_wall(builder, 2.5);
      add_body(builder, "crew", Box{{0.4, 0.4, 0.4}}, kCrew, {-1, 0, 0}, 0.5).linear_velocity = {1, 0, 0};
    });
  };
  scene.results = [=](const Course& course) -> Results {
    const auto momentum = [&](const Glance& hull, const Glance& crew) {
      return kHull * hull.velocity.x() + kCrew * (hull.velocity.x() + crew.velocity.x());
    };
    const double right = momentum(course.first("hull"), course.first("crew"));
    const double got = momentum(course.last("hull"), course.last("crew"));
    return {{"momentum", "kg m/s", right, got, 1e-6 * right},
            {"the hull goes faster", "m/s", kCrew / (kHull + kCrew),
             course.last("hull").velocity.x() - course.first("hull").velocity.x(), kCrew / kHull * 0.1}};
  };
  return scene;
}

// --- around a planet, on a circle ---

constexpr double kPlanetRadius = 6.371e6;             // m
constexpr double kOrbitRadius = kPlanetRadius + 4e5;  // m
const double kOrbitRate = std::sqrt(kGravity * kPlanetRadius * kPlanetRadius / kOrbitRadius) / kOrbitRadius;

// A hull that does not turn and carries a frame, with what else `fill` adds to the world around it and to the
// frame, whose origin is the centre of the hull.
WorldDescription station_in_orbit(
    const WorldSettings& given, const std::function<void(WorldBuilder& around, WorldBuilder& aboard)>& fill) {
  WorldSettings settings = given;
  settings.gravity = CentralGravity{{}, kGravity, kPlanetRadius};
  settings.sleep_after = 0;
  MovingFrame frame;
  frame.name = "station";
  frame.carrier = FrameCarrier{BodyId{1}, {}};
  WorldBuilder around(settings);
  around.world().settings.frames.push_back(frame);
  add_body(around, "hull", Box{{6, 6, 6}}, 20000, {kOrbitRadius, 0, 0}, 0.5);
  WorldBuilder aboard(settings);
  fill(around, aboard);
  for (BodyDescription& body : around.world().bodies)
    body.linear_velocity = {0, kOrbitRate * kOrbitRadius, 0};
  for (BodyDescription body : aboard.world().bodies) {
    body.properties.shape += static_cast<ShapeId>(around.world().shapes.size());
    body.pose.position.sector.frame = 1;
    around.world().bodies.push_back(body);
  }
  std::ranges::copy(aboard.world().shapes, std::back_inserter(around.world().shapes));
  place_carried(around.world());
  return around.world();
}

Vector3d on_circle(double time) {
  const double turn = kOrbitRate * time;
  return kOrbitRadius * Vector3d(std::cos(turn), std::sin(turn), 0);
}

// Let go above the centre, cargo drifts by the tide (Clohessy and Wiltshire, Terminal Guidance System for
// Satellite Rendezvous, 1960); the hull does not feel it.
Scene floats_in_orbit() {
  static constexpr double kHigh = 0.5;  // m
  Scene scene = frame_scene("floats_in_orbit", 600);
  scene.has_border = false;
  scene.every = 60;
  scene.world = [](const WorldSettings& settings) {
    return station_in_orbit(settings, [](WorldBuilder&, WorldBuilder& aboard) {
      add_body(aboard, "cargo", Box{{0.4, 0.4, 0.4}}, 5000, {kHigh, 0, 0}, 0.5);
    });
  };
  scene.results = [](const Course& course) -> Results {
    const double turn = kOrbitRate * course.seconds();
    const Vector3d along_orbit(kHigh * (2 - std::cos(turn)), kHigh * (2 * std::sin(turn) - 3 * turn), 0);
    const Vector3d right = rotation_by({0, 0, turn}) * along_orbit;
    return {{"cargo off its place", "m", 0, (course.last("cargo").place - right).norm(), 1e-4},
            {"hull off its place", "m", 0, (course.last("hull").place - on_circle(course.seconds())).norm(),
             0.01}};
  };
  return scene;
}

// Two hulls that a joint holds fall as one body. Beside the plane of the orbit, their centre of mass swings
// through it. In single precision, speeds are rounded to 0.5 mm/s in each tick.
Scene docked_in_orbit() {
  static constexpr double kShip = 10000;  // kg
  static constexpr double kApart = 9;     // m
  Scene scene = frame_scene("docked_in_orbit", 600);
  scene.has_border = false;
  scene.every = 60;
  scene.world = [](const WorldSettings& settings) {
    return station_in_orbit(settings, [](WorldBuilder& around, WorldBuilder&) {
      add_body(around, "ship", Box{{3, 3, 3}}, kShip, {kOrbitRadius, 0, kApart}, 0.5);
      around.tie("dock", JointType::kFixed, "hull", "ship", {kOrbitRadius, 0, kApart / 2});
    });
  };
  scene.results = [](const Course& course) -> Results {
    const double share = kShip / (20000 + kShip);
    const Vector3d hull = course.last("hull").place;
    const Vector3d across = course.last("ship").place - hull;
    const Vector3d beside = share * kApart * std::cos(kOrbitRate * course.seconds()) * Vector3d::UnitZ();
    const Vector3d off = hull + share * across - on_circle(course.seconds()) - beside;
    const bool is_fine = course.world().settings.precision == Precision::kFloat64;
    return {{"off their place", "m", 0, off.norm(), is_fine ? 0.01 : 50},
            {"distance", "m", kApart, across.norm(), 1e-4}};
  };
  return scene;
}

}  // namespace

std::vector<Scene> frame_scenes() {
  return {flies_in_a_habitat("let_go_in_a_habitat", Vector3d::Zero()),
          flies_in_a_habitat("thrown_in_a_habitat", {4, -1, 7}),
          slides_in_a_habitat(),
          circles_for_an_hour(),
          foucault("foucault", 0.02, 60),
          foucault("foucault_for_an_hour", kEarthSpin, 3600),
          brakes("brakes_that_friction_holds", 2),
          brakes("brakes_that_slide", 4),
          thrown_along_keys(),
          slides_along_keys(),
          thrown_aboard_in_a_habitat(),
          thrust_with_cargo("thrust_with_cargo", 200),
          thrust_with_cargo("thrust_with_heavy_cargo", 5000),
          crew_to_the_bow(),
          floats_in_orbit(),
          docked_in_orbit()};
}

}  // namespace tessera::truth
