// Programs at random, of every kind that bodies of a world may have: those of its modules, of a module that
// it does not have yet, and those that are built in, so that a new one is drawn without a line here.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "lpss/programs/program.h"
#include "simulator/dice.h"
#include "simulator/known_world.h"
#include "tessera.pb.h"

namespace tessera {

class AnyProgram {
 public:
  // Draws a number that is no body and no joint.
  using Number = std::function<double(const NumberSpec&)>;

  AnyProgram(Dice& dice, const KnownWorld& world, Number number);

  // For a body that moves so, of a model of so many `bodies` and `joints`.
  v1::Program for_body(v1::Motion motion, std::uint64_t bodies, std::uint64_t joints);

  // Told to a program that the world is known to have, of which there must be one.
  v1::TellProgram told();
  // The numbers of any kind, as a program is told them.
  void tell_any(google::protobuf::RepeatedPtrField<v1::NamedNumber>& numbers);

 private:
  using Numbers = google::protobuf::RepeatedPtrField<v1::NamedNumber>;

  // Of a body or joint, as the number's unit says.
  using Id = std::function<std::uint64_t(const NumberSpec&)>;

  std::uint64_t known_id(const NumberSpec& spec);
  void fill(const Program& program, const Id& id, Numbers& numbers);

  Dice& dice_;
  const KnownWorld& world_;
  Number number_;
  std::vector<const Program*> kinds_;
};

// Within its bounds, and near to what it is at first: what the program is made for.
double usual_number(Dice& dice, const NumberSpec& spec);

}  // namespace tessera
