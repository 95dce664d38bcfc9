// Camera: what is known of a camera whose images nobody renders.
#include <array>

#include "lpss/programs/builtin.h"

namespace tessera {
namespace camera {
namespace {

constexpr double kPixelsMost = 65536;

constexpr auto kParameters = std::to_array<NumberSpec>({
    {"x", "m", 0, -1e3, 1e3, "Where it is in the body frame,"},
    {"y", "m", 0, -1e3, 1e3, "along its y axis,"},
    {"z", "m", 0, -1e3, 1e3, "and along its z axis."},
    {"roll", "rad", 0, -7, 7, "How it is turned in the body frame: about the x axis first,"},
    {"pitch", "rad", 0, -7, 7, "then about the y axis,"},
    {"yaw", "rad", 0, -7, 7, "then about the z axis of the body. It looks along its x axis."},
    {"width", "pixels", 320, 1, kPixelsMost, "The width of its images,"},
    {"height", "pixels", 240, 1, kPixelsMost, "and their height."},
    {"angle", "rad", 1.047, 0.01, 6.2832, "Its field of view from the left to the right edge of the images."},
    {"rate", "Hz", 0, 0, 1e4, "How often it takes an image; 0: in every tick."},
    {"focal_x", "pixels", 0, 0, 1e9, "The horizontal focal length; 0: it follows from the angle,"},
    {"focal_y", "pixels", 0, 0, 1e9, "and the vertical one; 0: the same as the horizontal one."},
    {"centre_x", "pixels", -1, -1, kPixelsMost,
     "Where its line of sight meets the image, from the left edge; -1: in the middle,"},
    {"centre_y", "pixels", -1, -1, kPixelsMost, "and from the upper edge; -1: likewise."},
    {"k1", "", 0, -1e6, 1e6, "Radial distortion, by Brown's model,"},
    {"k2", "", 0, -1e6, 1e6, "likewise,"},
    {"p1", "", 0, -1e6, 1e6, "tangential distortion,"},
    {"p2", "", 0, -1e6, 1e6, "likewise,"},
    {"k3", "", 0, -1e6, 1e6, "and radial distortion."},
});

class Camera final : public Program {
 public:
  absl::string_view kind() const override { return "camera"; }
  absl::string_view summary() const override {
    return "Says where a camera is and what its lens is like. Its images are not rendered.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return {}; }

  void run(const Senses&, std::span<double>, Actor&) const override {}
};

}  // namespace
}  // namespace camera

const Program& camera_program() {
  static const camera::Camera kCamera;
  return kCamera;
}

}  // namespace tessera
