// Building blocks of scenes in several groups.
#pragma once

#include "experiments/extremes/scene.h"

namespace tessera::extremes {

WorldSettings sleepless(WorldSettings settings);
WorldSettings weightless(WorldSettings settings);  // and sleepless

// The world with its own settings, except the precision.
Build with_settings(const WorldSettings& own, Build world);

// A world that must be refused.
Scene refused_scene(const std::string& group, const std::string& name, Build world, const std::string& fails);

// Measures the relative elongation of a chain of `length` m, which hangs from the world's origin, by the
// distance of its last body.
void measure_stretch(Scene& scene, double length);

}  // namespace tessera::extremes
