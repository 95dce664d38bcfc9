// What following the load gives, by policy, and what a server has to do with others as worlds grow.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// The crowd of crowd_world(): without any move, in a fixed grid, and by each policy that follows the load:
// after the fact, and two seconds ahead. Everything else is as in run_crowd().
//
// Table "rows": {engine, policy, ahead_s, largest_ms, mean_ms, largest_to_mean, largest_p99_ms, late, ticks,
// real_time_factor, moves, moved_sectors, moved_bodies, moved_kb, exchanged_kb_per_tick, same_bits, hash}.
// `same_bits`: the hash is that of the first run, which has no moves.
//
// Table "walk", likewise: the crowd of walk_world(), for ten minutes, which takes hours. Only where it is
// asked for: ExperimentOptions::only begins with "walk".
//
// Worlds that grow with their servers (neighbours_world()): table "neighbours", of partitions of one process,
// {engine, layout, servers, talk_to, messages, messages_largest, kb, kb_largest, peers, peers_largest,
// heap_kb, same_bits, and what is sent by round}, sent and received a server and tick; table "processes",
// {engine, servers, talk_to, sent_messages, ..., peak_rss_mb, coordinator_us, same_bits}, of which
// `coordinator_us` is the processor time of the coordinator in a tick.
//
// ExperimentOptions::only chooses among "crowd POLICY", "walk POLICY", "row SERVERS", "plane SERVERS" and
// "processes SERVERS"; NOT_FOUND if none contains it.
absl::StatusOr<Report> measure_scale(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
