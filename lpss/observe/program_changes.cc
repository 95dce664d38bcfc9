#include "lpss/observe/program_changes.h"

#include <algorithm>
#include <utility>

namespace tessera {

void ProgramChanges::look(const Partition& partition) {
  ++looks_;
  std::swap(known_, before_);
  known_.clear();
  auto before = before_.begin();
  for_each_programmed(partition, [&](const ProgramsView& of) {
    Known now{of.id, {}, looks_};
    now.programs.add_programs(of.id, of.programs);
    while (before != before_.end() && before->id < now.id) ++before;
    const bool is_same = before != before_.end() && before->id == now.id && before->programs == now.programs;
    if (is_same) now.changed = before->changed;
    known_.push_back(now);
  });
}

void ProgramChanges::for_each_since(const Partition& partition, std::uint64_t look,
                                    absl::FunctionRef<void(const ProgramsView&)> visit) const {
  for (const Known& known : known_) {
    if (known.changed <= look) continue;
    if (const std::optional<ProgramsView> of = programs_of(partition, known.id)) visit(*of);
  }
}

}  // namespace tessera
