// What a web UI may do, and what it shows.
#pragma once

#include <memory>

#include "viewer/file_looks.h"
#include "viewer/recorder.h"
#include "viewer/world_shelf.h"

namespace tessera::viewer {

struct PageOptions {
  bool read_only = false;
  bool may_load = true;            // worlds and snapshots, as the role admin may; not with `read_only`
  double frames_per_second = 30;   // at most
  double states_per_second = 1e5;  // of bodies: with more in view, fewer frames
  std::shared_ptr<FileLooks> looks = std::make_shared<FileLooks>("");
  std::shared_ptr<const WorldShelf> shelf = std::make_shared<WorldShelf>("", "");
  std::shared_ptr<Recorder> recorder = std::make_shared<Recorder>(RecorderOptions{});  // of all tabs
};

}  // namespace tessera::viewer
