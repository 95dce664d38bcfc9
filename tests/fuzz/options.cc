// Configuration files of the daemons, which are written again as they are in effect.
#include "coordinator/options.h"

#include <CLI/CLI.hpp>
#include <sstream>
#include <string>

#include "daemon/configuration.h"
#include "sector_server/options.h"
#include "tests/fuzz/input.h"

namespace tessera {
namespace {

template <typename Arguments>
void read(const std::string& text, const char* name) {
  CLI::App app("", name);
  Arguments arguments;
  add_options(app, arguments);
  read_configuration(app);
  app.allow_config_extras(CLI::config_extras_mode::error);
  try {
    std::istringstream in(text);
    app.parse_from_stream(in);
  } catch (const CLI::Error&) {
    return;
  }
  static_cast<void>(configuration_text({&app}));
}

}  // namespace
}  // namespace tessera

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera;
  const std::string text(fuzz::text_of(data, size));
  read<CoordinatorArguments>(text, kCoordinatorName);
  read<SectorServerArguments>(text, kSectorServerName);
  return 0;
}
