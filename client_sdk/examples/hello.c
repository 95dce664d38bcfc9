/* A crate that is pushed, and a ray that finds it. Needs a cluster (`tessera up`) with a world on it. */
#include <stdio.h>

#include "tessera/c.h"

static int failed(const char* what) {
  fprintf(stderr, "%s: %s\n", what, tessera_error_message());
  return 1;
}

int main(int argc, char** argv) {
  tessera_client* client;
  if (tessera_connect(argc > 1 ? argv[1] : "127.0.0.1:7300", 10, &client)) return failed("connect");

  const double size[3] = {1, 1, 1};
  const double up[3] = {0, 0, 20};
  const tessera_position at = {{0, 0, 0}, {0, 0, 5}, 0};
  uint64_t crate;
  if (tessera_spawn_box(client, "crate", size, 10, &at, &crate)) return failed("spawn");
  if (tessera_apply_impulse(client, crate, up, NULL)) return failed("impulse");

  tessera_stream* stream;
  uint64_t last;
  if (tessera_watch(client, &crate, 1, &stream)) return failed("watch");
  if (tessera_step(client, 60, &last)) return failed("step");
  for (uint64_t tick = 0; tick < last;) {
    tessera_body body;
    size_t count;
    if (tessera_next(stream, 10, &tick, &body, 1, &count)) return failed("next");
    if (count == 1) printf("%llu: %g m\n", (unsigned long long)tick, body.position.local[2]);
  }
  tessera_unwatch(stream);

  char hash[33];
  if (tessera_hash(client, hash, NULL)) return failed("hash");
  puts(hash);
  tessera_disconnect(client);
  return 0;
}
