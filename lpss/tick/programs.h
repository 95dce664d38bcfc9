// Programs: at the end of a tick, instances ask, decide and act (lpss/programs/program.h).
//
// Three rounds, of all servers, in worlds with programs alone:
//
// - Asks: what others may have to answer, since it is about bodies or places near their sectors. Where a
// server
//   has bodies that may be anywhere, which is rare, all casts are asked of all, in one more such round.
// - Answers: only where somebody has asked somebody.
// - Acts: what instances do; all servers keep all of it (Partition::acts) until the next tick begins.
//
// Questions are answered by the servers that host what is asked about, from the world as the tick leaves it,
// and in the order of distances and ids: so an instance senses the same wherever it and others live.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "lpss/observe/queries.h"
#include "lpss/partition/partition.h"
#include "lpss/programs/program.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// Of a loop over instances.
inline constexpr std::size_t kProgramsInPiece = 8;

// What programs do in one tick, on one server.
class ProgramPhase {
 public:
  // `queries` are of the partition, and kept from tick to tick.
  ProgramPhase(Partition& partition, Queries& queries, Tick tick, ParallelFor parallel);

  // By rank; nothing for oneself, whose questions are answered at once.
  std::vector<ProgramAsks> ask();

  // Takes what all have asked. Whether all must ask everybody, in one more round.
  [[nodiscard]] bool take(std::vector<ProgramAsks> asked);
  // The casts that others have not been asked. By rank.
  std::vector<ProgramAsks> ask_everybody();

  // Whether somebody has asked somebody.
  bool are_asked() const;
  // By rank.
  std::vector<ProgramAnswers> answer();

  // Runs the instances with what all have answered.
  ProgramActs run(std::span<const ProgramAnswers> answers);

  std::size_t instances() const { return running_.size(); }

 private:
  struct Running {
    HomeBody* body = nullptr;
    std::size_t place = 0;      // of the program, on the body
    bool reads_others = false;  // Program::reads_others()
    BodyState state;
    Eigen::Vector3d gravity;
    Eigen::Vector3d start;
    std::vector<ProgramAsk> asks;
    ProgramAnswers found;
    std::vector<SensedJoint> joints;  // of which all has been found
    std::vector<Command> commands;
    std::string fault;  // why the program stops itself
  };
  // Where an answer goes that others give.
  struct Asked {
    std::size_t running = 0;  // a place in running_
    std::uint32_t ask = 0;
  };

  Senses senses_of(const Running& running) const;
  void add(HomeBody& body);
  void act(Running& running);
  bool concerns_others(const ProgramAsk& ask) const;
  bool concerns_others(JointId joint) const;
  std::vector<ProgramAsks> to_others(const ProgramAsks& asks) const;

  Partition& partition_;
  Queries& queries_;
  const Tick tick_;
  ParallelFor parallel_;
  std::vector<Running> running_;          // ascending by (body, place)
  std::vector<Asked> asked_;              // in the order in which others were asked
  std::vector<Asked> kept_;               // casts that they were not asked
  std::vector<ProgramAsks> asked_of_us_;  // by rank
};

// The acts of all servers, in the order of (by, program).
std::vector<Command> collected_acts(std::vector<ProgramActs>& acts);

// Adds what wakes the programs of triggers into which something came, or which it left.
void append_wakes(std::vector<BodyId> triggers, ProgramActs& acts);

// Whether an instance in a sector has asked to be woken.
bool awaits_programs(const Sector& sector);

}  // namespace tessera
