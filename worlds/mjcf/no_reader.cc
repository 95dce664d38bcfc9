// The reader of MJCF where MuJoCo was not found.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include "worlds/mjcf/reader.h"

namespace tessera::mjcf {

absl::StatusOr<WorldDescription> read_mjcf(xml::File& file, Notices&, Looks*) {
  return absl::FailedPreconditionError(
      absl::StrCat(file.name(),
                   ": files of MuJoCo need its library: install the package libmujoco-dev, then "
                   "configure and build again; in a clone, deploy/build.sh release tessera tessera-mjcf "
                   "does so"));
}

}  // namespace tessera::mjcf
