#include "cli/status_text.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include "cli/terminal.h"
#include "cli/text.h"

namespace tessera::cli {

std::string megabytes(double bytes) { return absl::StrFormat("%.0f MB", bytes / 1e6); }

std::string label(const ServerStatus& server) {
  return absl::StrFormat("%x%s", server.node,
                         server.suspect      ? " silent"
                         : server.slow       ? " slow"
                         : server.drained    ? " drained"
                         : server.takes_part ? ""
                                             : " idle");
}

std::string summary(const ClusterStatus& status) {
  const Colour colour = status.state == "failed"    ? Colour::kRed
                        : status.state == "running" ? Colour::kGreen
                                                    : Colour::kYellow;
  std::string text =
      absl::StrFormat("%s  %s, tick %s, %.3f s, real-time factor %.2f\n", coloured(status.state, colour),
                      status.world.empty() ? "no world" : status.world, grouped(status.tick), status.time,
                      status.real_time_factor);
  if (!status.failure.empty()) absl::StrAppend(&text, coloured(status.failure, Colour::kRed), "\n");
  absl::StrAppend(&text, "bodies ", grouped(status.bodies));
  for (const TickCounter& counter : kTickCounters) {
    const bool is_total = counter.over_ticks == OverTicks::kTotal;
    const TickCounts& counts = is_total ? status.counts_since_load : status.counts;
    absl::StrAppend(&text, ", ", title_of(counter), " ", grouped(counts.*counter.value));
  }
  absl::StrAppend(&text, "\n");
  if (!status.divergences.empty()) {
    const std::uint64_t more = status.counts_since_load.diverged - 1;
    absl::StrAppend(&text,
                    coloured(absl::StrCat("diverged: ", to_text(status.divergences.front())), Colour::kRed),
                    more == 0 ? "" : absl::StrCat(", and ", grouped(more), " more"), "\n");
  }
  if (!status.store_failure.empty()) {
    absl::StrAppend(&text,
                    coloured(absl::StrCat(status.waits_for_store ? "the world waits for its store: "
                                                                 : "the store cannot be written: ",
                                          status.store_failure),
                             Colour::kRed),
                    "\n");
  }
  for (const LeftOutCommands& each : status.left_out) {
    absl::StrAppend(
        &text,
        coloured(absl::StrCat("left out at tick ", grouped(each.tick), ": ", each.reason), Colour::kRed),
        ": ", each.commands, "\n");
  }
  if (status.recoveries > 0) {
    absl::StrAppend(&text, "went on from a checkpoint ", grouped(status.recoveries),
                    " times, the latest is of tick ", grouped(status.checkpoint_tick), "\n");
  }
  for (const CutOff& server : status.cut_off) {
    absl::StrAppendFormat(
        &text, "at tick %s, went on without server %x%s, which was cut off from %s for %.1f s\n",
        grouped(server.tick), server.node,
        server.stream_address.empty() ? "" : absl::StrCat(" (", server.stream_address, ")"),
        absl::StrJoin(server.unheard_by, ", ",
                      [](std::string* out, std::uint64_t node) { absl::StrAppendFormat(out, "%x", node); }),
        server.seconds);
  }
  if (status.joined_servers + status.left_servers > 0) {
    absl::StrAppend(&text, "while it ran, ", grouped(status.joined_servers), " servers have joined it, and ",
                    grouped(status.left_servers), " have left\n");
  }
  if (status.moved_sectors > 0) {
    absl::StrAppend(&text, "to share out the work, ", grouped(status.moved_sectors), " sectors with ",
                    grouped(status.moved_bodies), " bodies have changed servers\n");
  }
  absl::StrAppendFormat(&text, "tick mean %.2f ms, p50 %.2f ms, p99 %.2f ms, max %.2f ms; coordinator %s\n",
                        status.tick_ms.mean, status.tick_ms.p50, status.tick_ms.p99, status.tick_ms.max,
                        megabytes(static_cast<double>(status.coordinator_peak_rss_bytes)));
  return text;
}

}  // namespace tessera::cli
