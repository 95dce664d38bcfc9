// What a module may import from its host: functions of the module "tessera". Numbers are f64, flags and
// places i32; a place in the memory of the module is an i32, too. docs/programs.md says what they do.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace tessera::wasm {

enum class Import : std::uint8_t {
  kParameters,
  kInputs,
  kValues,
  kSetValues,
  kSenses,
  kRandom,
  kFindings,
  kFinding,
  kJointFindings,
  kJointFinding,
  kCast,
  kContacts,
  kInside,
  kBody,
  kJoints,
  kJoint,
  kPush,
  kPushAwake,
  kImpulse,
  kMoveTo,
  kTell,
  kDrive,
  kRemoveJoint,
  kWakeIn,
};

// Types are letters: i of i32, F of f64.
struct ImportSpec {
  std::string_view name;
  std::string_view parameters;
  std::string_view result;  // empty: none
};

// By Import.
inline constexpr ImportSpec kImports[] = {
    {"parameters", "i", ""},      {"inputs", "i", ""},       {"values", "i", ""},
    {"set_values", "i", ""},      {"senses", "i", ""},       {"random", "i", "F"},
    {"findings", "i", "i"},       {"finding", "iii", ""},    {"joint_findings", "i", "i"},
    {"joint_finding", "iii", ""}, {"cast", "FFFFFFFFi", ""}, {"contacts", "F", ""},
    {"inside", "F", ""},          {"body", "F", ""},         {"joints", "", ""},
    {"joint", "F", ""},           {"push", "FFFFFF", ""},    {"push_awake", "FFFFFF", ""},
    {"impulse", "FFFFFFF", ""},   {"move_to", "FFF", ""},    {"tell", "FiiF", ""},
    {"drive", "FiiFFFFF", ""},    {"remove_joint", "F", ""}, {"wake_in", "i", ""},
};
inline constexpr std::size_t kImportParametersMax = 9;

// What a sandboxed module exports, beside its memory: functions without parameters, with an i32 as result.
enum class Export : std::uint8_t {
  kAsk,    // runs ask(); which blocks of memory it has written, as bits
  kRun,    // likewise run()
  kLeft,   // what is left of the budget; below 0: it was spent
  kDepth,  // what is left of the stack; likewise
};
inline constexpr std::array<std::string_view, 4> kExports = {"ask", "run", "left", "depth"};
inline constexpr std::string_view kMemoryExport = "memory";

}  // namespace tessera::wasm
