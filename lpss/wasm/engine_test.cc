// Sandboxed modules in the engine, and in the interpreter of wabt: the same bits, and the same ends.
#include "lpss/wasm/engine.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "lpss/wasm/limits.h"
#include "lpss/wasm/sandbox.h"
#include "lpss/wasm/test_modules.h"

namespace tessera::wasm {
namespace {

using ::testing::HasSubstr;

// Notes what is pushed, as bits.
class NotingHost final : public Host {
 public:
  bool call(Import import, const double* arguments, double& result) override {
    if (import == Import::kRandom) result = 0.25 + arguments[0];
    if (import != Import::kPush) return import != Import::kSenses;
    for (int n = 0; n < 6; ++n) pushed.push_back(std::bit_cast<std::uint64_t>(arguments[n]));
    return true;
  }
  std::vector<std::uint64_t> pushed;
};

// One run, and what is known after it.
struct Outcome {
  bool is_done = false;
  std::int32_t dirty = 0;
  std::int32_t left = 0;
  std::int32_t depth = 0;
  std::string trap;
  std::vector<std::uint64_t> pushed;
  std::string memory;
};

Outcome run(Instance& instance, std::size_t memory_bytes) {
  Outcome outcome;
  NotingHost host;
  std::string trap;
  outcome.is_done = instance.call(Export::kRun, host, outcome.dirty, outcome.trap);
  EXPECT_TRUE(instance.call(Export::kLeft, host, outcome.left, trap));
  EXPECT_TRUE(instance.call(Export::kDepth, host, outcome.depth, trap));
  outcome.pushed = host.pushed;
  outcome.memory.assign(reinterpret_cast<const char*>(instance.memory()), memory_bytes);
  return outcome;
}

Outcome run_in(Engine& engine, const SandboxedModule& module) {
  std::string error;
  const std::shared_ptr<const Code> code = engine.compile(module.binary.data(), module.binary.size(), error);
  EXPECT_NE(code, nullptr) << error;
  if (!code) return {};
  const std::unique_ptr<Instance> instance = engine.instantiate(*code, error);
  EXPECT_NE(instance, nullptr) << error;
  return instance ? run(*instance, module.memory.size()) : Outcome{};
}

// In both engines.
Outcome run_everywhere(const std::string& fields) {
  const absl::StatusOr<SandboxedModule> module = sandboxed(test_module(absl::StrCat(R"((module
          (import "tessera" "push" (func $push (param f64 f64 f64 f64 f64 f64)))
          (import "tessera" "random" (func $random (param i32) (result f64)))
          (import "tessera" "senses" (func $senses (param i32)))
          (func $see (param f64)
            (call $push (local.get 0) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0)))
          )",
                                                                                    fields, ")")));
  EXPECT_TRUE(module.ok()) << module.status();
  const absl::StatusOr<Engine*> engine = load_engine();
  EXPECT_TRUE(engine.ok()) << engine.status();
  if (!module.ok() || !engine.ok()) return {};
  const Outcome ours = run_in(**engine, *module);
  const Outcome reference = run_in(*wabt_engine(), *module);
  EXPECT_EQ(ours.is_done, reference.is_done) << ours.trap << reference.trap;
  EXPECT_EQ(ours.left, reference.left);
  EXPECT_EQ(ours.depth, reference.depth);
  EXPECT_EQ(ours.pushed, reference.pushed);
  if (ours.is_done) {
    EXPECT_EQ(ours.dirty, reference.dirty);
    EXPECT_EQ(ours.memory, reference.memory);
  }
  return ours;
}

double number(std::uint64_t bits) { return std::bit_cast<double>(bits); }

TEST(Engine, RunsAModuleThatCallsItsHost) {
  const Outcome outcome = run_everywhere(R"((memory 1)
      (func (export "run") (call $see (f64.add (call $random (i32.const 3)) (f64.const 0.5)))))");
  EXPECT_TRUE(outcome.is_done) << outcome.trap;
  ASSERT_EQ(outcome.pushed.size(), 6u);
  EXPECT_EQ(number(outcome.pushed[0]), 3.75);
  EXPECT_EQ(outcome.dirty, 0);
}

TEST(Engine, ChargesEachInstructionOnce) {
  const Outcome outcome = run_everywhere(R"((memory 1)
      (func (export "run") (local $i i32)
        (loop $l (br_if $l (i32.lt_s (local.tee $i (i32.add (local.get $i) (i32.const 1))) (i32.const 100))))))");
  // The loop, 100 times its 7 instructions, and two ends.
  EXPECT_EQ(kInstructionsMax - outcome.left, 1 + 100 * 7 + 2);
}

TEST(Engine, EndsALoopAtTheSameInstruction) {
  const Outcome outcome = run_everywhere(R"((memory 1) (global $n (mut f64) (f64.const 0))
      (func (export "run")
        (loop $l (global.set $n (f64.add (global.get $n) (f64.const 1))) (call $see (global.get $n)) (br $l))))");
  EXPECT_FALSE(outcome.is_done);
  EXPECT_LT(outcome.left, 0);
  EXPECT_GT(outcome.pushed.size(), 1000u);
}

TEST(Engine, EndsCallsThatGoTooDeep) {
  for (const char* locals : {"", "(local f64 f64 f64 f64 f64 f64 f64 f64 f64 f64 f64 f64 f64 f64)"}) {
    const Outcome outcome =
        run_everywhere(absl::StrCat(R"((memory 1) (table 1 funcref) (elem (i32.const 0) $f)
        (func $f (param f64) )",
                                    locals, R"(
          (call $see (local.get 0))
          (call_indirect (param f64) (f64.add (local.get 0) (f64.const 1)) (i32.const 0)))
        (func (export "run") (call $f (f64.const 1))))"));
    EXPECT_FALSE(outcome.is_done);
    EXPECT_LT(outcome.depth, 0);
    EXPECT_GT(outcome.left, 0);
    EXPECT_GT(outcome.pushed.size(), 6 * 100u);
  }
}

TEST(Engine, GivesTheStackBackWhereCallsReturn) {
  const Outcome outcome = run_everywhere(R"((memory 1)
      (func $fib (param i32) (result i32)
        (if (result i32) (i32.lt_s (local.get 0) (i32.const 2)) (then (local.get 0))
          (else (i32.add (call $fib (i32.sub (local.get 0) (i32.const 1)))
                         (call $fib (i32.sub (local.get 0) (i32.const 2)))))))
      (func (export "run") (call $see (f64.convert_i32_s (call $fib (i32.const 15))))))");
  EXPECT_TRUE(outcome.is_done) << outcome.trap;
  EXPECT_EQ(number(outcome.pushed.at(0)), 610);
  EXPECT_EQ(outcome.depth, kStackMax);
}

TEST(Engine, EndsWhatTraps) {
  const auto traps = [](const std::string& code) {
    const Outcome outcome =
        run_everywhere(absl::StrCat("(memory 1) (table 1 funcref) (func (export \"run\") ", code, ")"));
    EXPECT_FALSE(outcome.is_done) << code;
    return outcome.trap;
  };
  EXPECT_EQ(traps("unreachable"), "unreachable executed");
  EXPECT_EQ(traps("(drop (i32.load (i32.const 65533)))"), "index out of bounds");
  EXPECT_EQ(traps("(i64.store offset=0xffffffff (i32.const -1) (i64.const 1))"), "index out of bounds");
  EXPECT_EQ(traps("(drop (i32.div_s (i32.const 1) (i32.const 0)))"), "integer divide by zero");
  EXPECT_EQ(traps("(drop (i32.trunc_f64_s (f64.const 1e300)))"), "integer overflow");
  EXPECT_EQ(traps("(call_indirect (i32.const 0))"), "indirect call to null");
  EXPECT_EQ(traps("(memory.fill (i32.const 0) (i32.const 1) (i32.const 65537))"), "index out of bounds");
  EXPECT_EQ(traps("(call $senses (i32.const 0))"), "") << "the host ends it";
}

TEST(Engine, GrowsMemoryUpToItsBound) {
  const Outcome outcome = run_everywhere(R"((memory 1 3)
      (func $grow (param i32) (call $see (f64.convert_i32_s (memory.grow (local.get 0)))))
      (func (export "run")
        (call $grow (i32.const 1)) (call $grow (i32.const 2)) (call $grow (i32.const -1)) (call $grow (i32.const 1))
        (call $see (f64.convert_i32_s (memory.size)))
        (i32.store (i32.const 196604) (i32.const 7))))");
  EXPECT_TRUE(outcome.is_done) << outcome.trap;
  std::vector<double> answers;
  for (std::size_t n = 0; n < outcome.pushed.size(); n += 6) answers.push_back(number(outcome.pushed[n]));
  EXPECT_THAT(answers, ::testing::ElementsAre(1, -1, -1, 2, 3));
  EXPECT_EQ(outcome.memory.size(), 3 * kPageBytes);
}

TEST(Engine, NotesWhatIsWritten) {
  const auto dirty = [](const std::string& code) {
    return static_cast<std::uint32_t>(
        run_everywhere(absl::StrCat("(memory 1) (func (export \"run\") ", code, ")")).dirty);
  };
  EXPECT_EQ(dirty("(i32.store8 (i32.const 0) (i32.const 1))"), 1u);
  EXPECT_EQ(dirty("(f64.store offset=2048 (i32.const 2047) (f64.const 1))"), 2u);
  EXPECT_EQ(dirty("(i64.store32 (i32.const 65532) (i64.const 1)) (f32.store (i32.const 4096) (f32.const 1))"),
            0x80000004u);
  EXPECT_EQ(dirty("(memory.copy (i32.const 0) (i32.const 8) (i32.const 8))"), 0xffffffffu);
}

TEST(Engine, HasOneNaN) {
  const Outcome outcome = run_everywhere(R"((memory 1)
      (func $bits (param f64)
        (call $see (f64.convert_i64_u (i64.reinterpret_f64 (local.get 0))))
        (f64.store (i32.const 8) (local.get 0))
        (call $see (f64.convert_i64_u (i64.load (i32.const 8))))
        (call $see (f64.copysign (f64.const 3) (local.get 0)))
        (call $see (f64.convert_i32_u (i32.reinterpret_f32 (f32.demote_f64 (local.get 0)))))
        (f32.store (i32.const 8) (f32.demote_f64 (local.get 0)))
        (call $see (f64.convert_i32_u (i32.load (i32.const 8)))))
      (func (export "run")
        (call $bits (f64.div (f64.const 0) (f64.const 0)))
        (call $bits (f64.neg (f64.div (f64.const 0) (f64.const 0))))
        (call $bits (f64.sub (f64.const inf) (f64.const inf)))
        (call $bits (f64.const -nan:0x123))
        (call $bits (f64.mul (f64.const nan:0x123) (f64.const -nan:0x77)))
        (call $bits (f64.promote_f32 (f32.reinterpret_i32 (i32.const 0xffc12345))))
        (call $bits (f64.min (f64.const -nan:0x123) (f64.const 1)))))");
  EXPECT_TRUE(outcome.is_done) << outcome.trap;
  ASSERT_EQ(outcome.pushed.size(), 7 * 5 * 6u);
  for (std::size_t n = 0; n < outcome.pushed.size(); n += 30) {
    EXPECT_EQ(number(outcome.pushed[n]), 0x7ff8000000000000);
    EXPECT_EQ(number(outcome.pushed[n + 6]), 0x7ff8000000000000);
    EXPECT_EQ(number(outcome.pushed[n + 12]), 3);
    EXPECT_EQ(number(outcome.pushed[n + 18]), 0x7fc00000);
    EXPECT_EQ(number(outcome.pushed[n + 24]), 0x7fc00000);
  }
}

// Instructions without traps on numbers of all kinds, by chance: what they leave on the stack is stored.
std::string numeric_module(unsigned seed) {
  std::mt19937 chance(seed);
  static const std::vector<std::pair<char, std::string>> kUnary = {
      {'F', "f64.sqrt"},    {'F', "f64.abs"},       {'F', "f64.neg"},       {'F', "f64.ceil"},
      {'F', "f64.floor"},   {'F', "f64.trunc"},     {'F', "f64.nearest"},   {'f', "f32.sqrt"},
      {'f', "f32.nearest"}, {'f', "f32.neg"},       {'I', "i64.clz"},       {'I', "i64.popcnt"},
      {'i', "i32.ctz"},     {'i', "i32.extend8_s"}, {'I', "i64.extend32_s"}};
  static const std::vector<std::string> kBinary = {"add", "sub", "mul"};
  static const std::vector<std::string> kOfFloats = {"div", "min", "max", "copysign"};
  static const std::vector<std::string> kOfIntegers = {"and",   "or",    "xor",  "shl",
                                                       "shr_s", "shr_u", "rotl", "rotr"};
  const std::string types = "iIfF";
  const auto name = [](char type) {
    return type == 'i' ? "i32" : type == 'I' ? "i64" : type == 'f' ? "f32" : "f64";
  };
  std::string code;
  const auto get = [&](char type) {
    return absl::StrCat("(local.get ", types.find(type) * 4 + chance() % 4, ")");
  };
  for (int n = 0; n < 200; ++n) {
    const char type = types[chance() % 4];
    const bool is_float = type == 'f' || type == 'F';
    std::string value;
    switch (chance() % 5) {
      case 0: {
        const auto& [of, instruction] = kUnary[chance() % kUnary.size()];
        absl::StrAppend(&code, "(local.set ", types.find(of) * 4 + chance() % 4, " (", instruction, " ",
                        get(of), "))\n");
        continue;
      }
      case 1: {
        static const std::vector<std::pair<std::string, std::string>> kConversions = {
            {"iF", "i32.trunc_sat_f64_s"},
            {"If", "i64.trunc_sat_f32_u"},
            {"Ff", "f64.promote_f32"},
            {"fF", "f32.demote_f64"},
            {"FI", "f64.convert_i64_u"},
            {"fI", "f32.convert_i64_s"},
            {"Fi", "f64.convert_i32_u"},
            {"IF", "i64.reinterpret_f64"},
            {"FI", "f64.reinterpret_i64"},
            {"fi", "f32.reinterpret_i32"},
            {"if", "i32.reinterpret_f32"},
            {"iI", "i32.wrap_i64"},
            {"iF", "f64.lt"}};
        const auto& [kinds, instruction] = kConversions[chance() % kConversions.size()];
        const std::string second = instruction == "f64.lt" ? get('F') : "";
        absl::StrAppend(&code, "(local.set ", types.find(kinds[0]) * 4 + chance() % 4, " (", instruction, " ",
                        get(kinds[1]), second, "))\n");
        continue;
      }
      default: {
        const auto& more = is_float ? kOfFloats : kOfIntegers;
        const std::string& instruction =
            chance() % 2 ? kBinary[chance() % kBinary.size()] : more[chance() % more.size()];
        absl::StrAppend(&code, "(local.set ", types.find(type) * 4 + chance() % 4, " (", name(type), ".",
                        instruction, " ", get(type), " ", get(type), "))\n");
      }
    }
  }
  std::string store;
  for (std::size_t n = 0; n < 16; ++n) {
    const char type = types[n / 4];
    absl::StrAppend(&store, "(", name(type), ".store (i32.const ", 8 * n, ") (local.get ", n, "))\n");
  }
  return absl::StrCat(
      R"((memory 1) (func $calculate (param i32 i32 i32 i32 i64 i64 i64 i64 f32 f32 f32 f32 f64 f64 f64 f64) )",
      code, store, R"() (func (export "run") (call $calculate
      (i32.const 7) (i32.const -3) (i32.const 0x80000000) (i32.const 0) (i64.const 9) (i64.const -1) (i64.const 0x8000000000000000)
      (i64.const 1234567890123) (f32.const 1.5) (f32.const -0.1) (f32.const nan) (f32.const 1e38) (f64.const 3.3) (f64.const -1e300)
      (f64.const nan:0x55) (f64.const 4.9e-324))))");
}

TEST(Engine, ComputesWhatAnInterpreterDoes) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    EXPECT_TRUE(run_everywhere(numeric_module(seed)).is_done);
  }
}

TEST(Engine, SharesCodeBetweenThreads) {
  const absl::StatusOr<SandboxedModule> module = sandboxed(test_module(R"((module (memory 1)
      (func (export "run") (f64.store (i32.const 0) (f64.sqrt (f64.const 2))))))"));
  ASSERT_TRUE(module.ok());
  const absl::StatusOr<Engine*> engine = load_engine();
  ASSERT_TRUE(engine.ok()) << engine.status();
  std::string error;
  std::shared_ptr<const Code> code = (*engine)->compile(module->binary.data(), module->binary.size(), error);
  ASSERT_NE(code, nullptr) << error;
  std::vector<std::thread> threads;
  for (int n = 0; n < 4; ++n) {
    threads.emplace_back([&, mine = code] {
      std::string failure;
      for (int again = 0; again < 3; ++again) {
        const std::unique_ptr<Instance> instance = (*engine)->instantiate(*mine, failure);
        ASSERT_NE(instance, nullptr) << failure;
        EXPECT_TRUE(run(*instance, module->memory.size()).is_done);
      }
    });
  }
  code.reset();
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace tessera::wasm
