// Bodies that are dropped and shot at terrain.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "experiments/extremes/scene_parts.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::extremes {
namespace {

constexpr double kSide = 250;   // m, of the terrain
constexpr double kRange = 200;  // m, of the square over which bodies are dropped
constexpr double kRadii[] = {0.01, 0.03, 0.1, 0.3, 1};
constexpr int kDroppedOnEach = 2000;

double hills(double x, double y) {
  return std::sin(0.7 * x) * std::cos(0.4 * y) + 0.2 * std::sin(3.1 * x + 2.3 * y);
}

// A square of samples, each cell parted by the diagonal from its high-x to its high-y corner.
class Grid {
 public:
  explicit Grid(int samples) : samples_(samples), spacing_(kSide / (samples - 1)) {}

  HeightField field() const {
    HeightField field;
    field.columns = field.rows = static_cast<std::uint32_t>(samples_);
    field.spacing = {spacing_, spacing_};
    for (int row = 0; row < samples_; ++row) {
      for (int column = 0; column < samples_; ++column) field.heights.push_back(sample(column, row));
    }
    return field;
  }

  TriangleMesh mesh() const {
    TriangleMesh mesh;
    for (int row = 0; row < samples_; ++row) {
      for (int column = 0; column < samples_; ++column)
        mesh.vertices.emplace_back(place(column), place(row), sample(column, row));
    }
    const auto stride = static_cast<std::uint32_t>(samples_);
    for (std::uint32_t row = 0; row + 1 < stride; ++row) {
      for (std::uint32_t column = 0; column + 1 < stride; ++column) {
        const std::uint32_t n = row * stride + column;
        for (const std::uint32_t corner : {n, n + 1, n + stride, n + 1, n + 1 + stride, n + stride})
          mesh.indices.push_back(corner);
      }
    }
    return mesh;
  }

  bool is_over(const Eigen::Vector3d& p) const { return p.head<2>().cwiseAbs().maxCoeff() < kSide / 2; }

  // The height of the surface at a place over it.
  double surface(double x, double y) const {
    const auto cell = [&](double at) {
      return std::clamp(static_cast<int>((at + kSide / 2) / spacing_), 0, samples_ - 2);
    };
    const int column = cell(x);
    const int row = cell(y);
    const double u = (x - place(column)) / spacing_;
    const double v = (y - place(row)) / spacing_;
    const double low = sample(column + 1, row);
    const double high = sample(column, row + 1);
    if (u + v <= 1) return sample(column, row) * (1 - u - v) + low * u + high * v;
    return sample(column + 1, row + 1) * (u + v - 1) + low * (1 - v) + high * (1 - u);
  }

 private:
  double place(int n) const { return spacing_ * n - kSide / 2; }
  double sample(int column, int row) const { return hills(place(column), place(row)); }

  int samples_;
  double spacing_;
};

// Sphere, box, capsule, cylinder, hull of about that radius.
constexpr int kKinds = 5;
Geometry geometry(int kind, double radius) {
  switch (kind) {
    case 0:
      return Sphere{radius};
    case 1:
      return Box{{2 * radius, 1.6 * radius, 1.2 * radius}};
    case 2:
      return Capsule{radius / 2, radius};
    case 3:
      return Cylinder{radius, radius};
    default:
      break;
  }
  ConvexHull hull;
  constexpr int kCorners = 12;
  for (int n = 0; n < kCorners; ++n) {
    const double z = 1 - 2 * (n + 0.5) / kCorners;
    const double turn = 2.399963 * n;
    const double out = std::sqrt(1 - z * z);
    hull.points.emplace_back(radius * out * std::cos(turn), radius * out * std::sin(turn), radius * z);
  }
  return hull;
}

double radius_of(int n) { return kRadii[n % std::size(kRadii)]; }

// Bodies of all kinds and sizes at all places, at up to 300 m/s.
void drop(WorldBuilder& builder) {
  std::map<std::pair<int, double>, ShapeId> shapes;
  for (int n = 0; n < kDroppedOnEach; ++n) {
    // Points of a lattice without period.
    const auto fraction = [n](double step) { return std::fmod(n * step, 1.0); };
    const Eigen::Vector3d place((fraction(0.7548776662) - 0.5) * kRange,
                                (fraction(0.5698402910) - 0.5) * kRange, 2.5 + 10 * fraction(0.6180339887));
    const double radius = radius_of(n);
    const int kind = n / 7 % kKinds;
    const auto [shape, is_new] = shapes.try_emplace({kind, radius}, 0);
    if (is_new) shape->second = builder.shape(geometry(kind, radius));
    BodyDescription& body =
        builder.add(absl::StrCat("body", n), shape->second, std::max(1e-5, std::pow(10 * radius, 3)), place);
    body.pose.orientation =
        Eigen::Quaterniond(fraction(0.311), fraction(0.511) - 0.5, fraction(0.711) - 0.5, 0.3).normalized();
    const double speed = n % 3 == 0 ? 0 : std::pow(300, fraction(0.3247179572));
    const double tilt = n % 2 == 0 ? 2 * fraction(0.1234567) : 0;
    body.linear_velocity = {speed * std::sin(tilt), 0, -speed * std::cos(tilt)};
    if (n % 5 == 1) body.angular_velocity = {3, 10, 5};
  }
}

Scene drop_scene(const std::string& name, int samples, bool is_mesh, double sector_size) {
  const Grid grid(samples);
  Scene scene;
  scene.group = "terrain";
  scene.name = name;
  scene.world = [grid, is_mesh, sector_size](const WorldSettings& given) {
    WorldSettings settings = given;
    settings.sector_size = sector_size;
    WorldBuilder builder(settings);
    const ShapeId ground = is_mesh ? builder.shape(grid.mesh()) : builder.shape(grid.field());
    builder.add("ground", ground, 1, Eigen::Vector3d::Zero(), Motion::kStatic);
    drop(builder);
    return builder.world();
  };
  scene.lasts = {480, 120, 0};
  scene.asks = {
      [grid](const Moment&, const Moment& now) {
        double below = 0;
        for (std::size_t n = 0; n < now.positions.size(); ++n) {
          const Eigen::Vector3d& p = now.positions[n];
          if (grid.is_over(p) && !(p.z() > grid.surface(p.x(), p.y()) - radius_of(static_cast<int>(n))))
            ++below;
        }
        return below;
      },
      "bodies below the ground", 0, "All lie on the ground.", "Some fall through the ground."};
  return scene;
}

}  // namespace

std::vector<Scene> terrain_scenes() {
  return {
      drop_scene("drops_on_a_mesh_of_1e3_triangles", 24, true, 128),
      drop_scene("drops_on_a_mesh_of_1e4_triangles_in_sectors_of_16_m", 72, true, 16),
      drop_scene("drops_on_a_mesh_of_1e5_triangles", 225, true, 128),
      drop_scene("drops_on_a_mesh_of_1e6_triangles_in_sectors_of_32_m", 708, true, 32),
      drop_scene("drops_on_a_field_of_2e6_triangles_in_sectors_of_16_m", 1001, false, 16),
  };
}

}  // namespace tessera::extremes
