// What the check of modules refuses, and where.
#include "lpss/wasm/sandbox.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "lpss/wasm/limits.h"
#include "lpss/wasm/test_modules.h"

namespace tessera::wasm {
namespace {

using ::testing::HasSubstr;

constexpr char kRun[] = R"((memory 1) (func (export "run")))";

std::string said(std::string_view file) { return std::string(sandboxed(file).status().message()); }
std::string said_of(const std::string& fields) {
  return said(test_module(absl::StrCat("(module ", fields, ")")));
}
std::string said_of_code(const std::string& code) {
  return said_of(absl::StrCat(
      R"((memory 1) (table 2 funcref) (global $g i32 (i32.const 0)) (func (export "run") )", code, ")"));
}

TEST(Sandbox, TakesTheSmallestModule) {
  const absl::StatusOr<SandboxedModule> module = sandboxed(test_module(absl::StrCat("(module ", kRun, ")")));
  ASSERT_TRUE(module.ok()) << module.status();
  EXPECT_EQ(module->description, "program | test | Tests.\n");
  EXPECT_EQ(module->memory.size(), kPageBytes);
  EXPECT_EQ(module->block_shift, 11u);
  EXPECT_FALSE(module->has_ask);
}

TEST(Sandbox, RefusesWhatIsNoModule) {
  EXPECT_EQ(said(""), "byte 0: it is no WebAssembly module");
  EXPECT_EQ(said("hello world"), "byte 4: it is no WebAssembly module");
  EXPECT_EQ(said(std::string("\0asm\2\0\0\0", 8)), "byte 8: its version of WebAssembly must be 1");
  EXPECT_EQ(said(std::string(kModuleBytesMax + 1, 'x')),
            "byte 1048576: its 1048577 bytes must be at most 1048576");
}

TEST(Sandbox, RefusesWhatAModuleMayNotHave) {
  EXPECT_THAT(said_of(""), HasSubstr("a module must have a memory"));
  EXPECT_THAT(said_of("(memory 1)"), HasSubstr("a module must export the function \"run\""));
  EXPECT_THAT(said(assembled(absl::StrCat("(module ", kRun, ")"))),
              HasSubstr("must have the custom section"));
  EXPECT_THAT(said_of(R"((memory 1) (func (export "run") (param i32)))"),
              HasSubstr("export section: \"run\" must have no parameters and no result"));
  EXPECT_THAT(said_of(R"((memory 33) (func (export "run")))"),
              HasSubstr("memory section: 33 pages of memory must be at most 32"));
  EXPECT_THAT(said_of(R"((memory 0) (func (export "run")))"), HasSubstr("at least one page"));
  EXPECT_THAT(said_of(R"((memory 1 2 shared) (func (export "run")))"), HasSubstr("what threads share"));
  EXPECT_THAT(said_of(absl::StrCat(kRun, "(func $s) (start $s)")),
              HasSubstr("start section: a module must not have a start function"));
  EXPECT_THAT(said_of(absl::StrCat(R"((import "env" "f" (func)))", kRun)),
              HasSubstr("import section: import \"f\" of \"env\" must be of \"tessera\""));
  EXPECT_THAT(said_of(absl::StrCat(R"((import "tessera" "clock" (func)))", kRun)),
              HasSubstr("import \"clock\" of \"tessera\" is unknown"));
  EXPECT_THAT(said_of(absl::StrCat(R"((import "tessera" "push" (func)))", kRun)),
              HasSubstr("import \"push\" of \"tessera\" is of another type"));
  EXPECT_THAT(said_of(R"((import "tessera" "memory" (memory 1)) (func (export "run")))"),
              HasSubstr("must be a function"));
  EXPECT_THAT(said_of(absl::StrCat(kRun, R"((data (i32.const 65536) "x"))")),
              HasSubstr("data section: data are outside the memory"));
  EXPECT_THAT(said_of(absl::StrCat(kRun, "(table 5000 funcref)")),
              HasSubstr("table section: 5000 functions of the table must be at most 4096"));
}

TEST(Sandbox, RefusesCodeThatIsNotValid) {
  EXPECT_EQ(said_of_code(""), "");
  EXPECT_THAT(said_of_code("i32.add drop"), HasSubstr("code section: function 0: an operand is missing"));
  EXPECT_THAT(said_of_code("(drop (i32.add (i32.const 1) (f64.const 1)))"),
              HasSubstr("an operand is of f64 and must be of i32"));
  EXPECT_THAT(said_of_code("(i32.const 1)"), HasSubstr("operands are left"));
  EXPECT_THAT(said_of_code("(block (result i32))  drop"), HasSubstr("an operand is missing"));
  EXPECT_THAT(said_of_code("(drop (if (result i32) (i32.const 1) (then (i32.const 1))))"),
              HasSubstr("an if with a result must have an else"));
  EXPECT_THAT(said_of_code("(br 7)"), HasSubstr("there is no block 7"));
  EXPECT_THAT(said_of_code("(call 9)"), HasSubstr("there is no function 9"));
  EXPECT_THAT(said_of_code("(local.set 3 (i32.const 1))"), HasSubstr("there is no local 3"));
  EXPECT_THAT(said_of_code("(global.set $g (i32.const 1))"), HasSubstr("global 0 is constant"));
  EXPECT_THAT(said_of_code("(table.set 0 (i32.const 0) (ref.null func))"), HasSubstr("is not allowed"));
  EXPECT_THAT(said_of_code("(drop (v128.const i32x4 0 0 0 0))"),
              HasSubstr("instruction 0xfd is not allowed"));
  EXPECT_THAT(said_of_code("(drop (i32.atomic.load (i32.const 0)))"),
              HasSubstr("instruction 0xfe is not allowed"));
  EXPECT_EQ(said_of_code("unreachable i32.add drop (br 0) f64.sqrt drop"), "");
}

// Whatever the bytes are, there is an answer; what is taken, an engine takes as well.
TEST(Sandbox, AnswersToDamagedModules) {
  const std::string whole = test_module(R"((module
      (import "tessera" "push" (func $push (param f64 f64 f64 f64 f64 f64)))
      (memory 1 4) (table 2 funcref) (global $g (mut f64) (f64.const 1.5)) (elem (i32.const 0) $f $f)
      (func $f (param i32) (result f64)
        (local $x f64)
        (loop $l (local.set $x (f64.add (local.get $x) (f64.load offset=8 (local.get 0))))
          (br_if $l (i32.lt_s (local.tee 0 (i32.add (local.get 0) (i32.const 1))) (i32.const 10))))
        (f64.store (i32.const 16) (local.get $x))
        (drop (memory.grow (i32.const 1)))
        (local.get $x))
      (func (export "run")
        (block $a (block $b (br_table $a $b (i32.const 1))))
        (global.set $g (call_indirect (param i32) (result f64) (i32.const 1) (i32.const 0)))
        (call $push (global.get $g) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0)))
      (data (i32.const 0) "abc")))");
  ASSERT_EQ(said(whole), "");
  const std::unique_ptr<Engine> engine = wabt_engine();
  std::mt19937 chance(1);
  int taken = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    std::string damaged = whole;
    for (unsigned changes = 1 + chance() % 3; changes > 0; --changes)
      damaged[chance() % damaged.size()] = static_cast<char>(chance());
    if (chance() % 8 == 0) damaged.resize(chance() % damaged.size());
    const absl::StatusOr<SandboxedModule> module = sandboxed(damaged);
    if (!module.ok()) continue;
    ++taken;
    std::string error;
    EXPECT_NE(engine->compile(module->binary.data(), module->binary.size(), error), nullptr) << error;
  }
  EXPECT_GT(taken, 100);
}

}  // namespace
}  // namespace tessera::wasm
