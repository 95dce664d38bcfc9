// Five lines to a falling crate. Needs a cluster (`tessera up`) with a world on it (`tessera load`).
#include <iostream>

#include "tessera/client.h"

int main(int argc, char** argv) {
  auto client = tessera::Client::connect(argc > 1 ? argv[1] : "127.0.0.1:7300").value();
  auto crate =
      client->spawn(tessera::solid("crate", tessera::box(1, 1, 1), 10, {{0, 0, 0}, {0, 0, 5}})).value();
  auto frames = client->watch_bodies({.ids = {crate.id}}).value();
  for (const auto last = client->step(60).value();;) {
    const auto frame = frames->next().value();
    for (const auto& body : frame.bodies)
      std::cout << frame.tick << ": " << body.pose.position.local.z() << " m\n";
    if (frame.tick == last) return 0;
  }
}
