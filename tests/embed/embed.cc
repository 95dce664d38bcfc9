// An application that runs a world file in its own process: embed WORLD TICKS prints the hash after TICKS
// ticks.
#include <cstdlib>
#include <iostream>

#include "lpss/simulation/simulation.h"
#include "worlds/loader/world_file.h"

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const auto loaded = tessera::load_world_file(argv[1]);
  if (!loaded.ok()) {
    std::cerr << loaded.status() << "\n";
    return 1;
  }
  const auto simulation = tessera::Simulation::create(loaded->world, /*threads=*/2);
  if (!simulation.ok()) {
    std::cerr << simulation.status() << "\n";
    return 1;
  }
  for (int tick = 0; tick < std::atoi(argv[2]); ++tick) (*simulation)->step();
  std::cout << (*simulation)->hash().to_string();
}
