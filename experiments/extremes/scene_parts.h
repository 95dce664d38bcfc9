// What scenes of several groups are made of.
#pragma once

#include "experiments/extremes/scene.h"

namespace tessera::extremes {

WorldSettings sleepless(WorldSettings settings);
WorldSettings weightless(WorldSettings settings);  // and sleepless

// The world under settings of its own, but for the precision.
Build with_settings(const WorldSettings& own, Build world);

// A world that there must not be.
Scene refused_scene(const std::string& group, const std::string& name, Build world, const std::string& fails);

// Measures by which share a chain of `length` m is longer: its last body is on a ball around the world's
// origin, where it hangs.
void measure_stretch(Scene& scene, double length);

}  // namespace tessera::extremes
