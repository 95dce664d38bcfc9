// What programs publish, tick by tick, from all servers of a cluster.
#include <algorithm>
#include <map>
#include <utility>

#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;

class ProgramStreamTest : public ::testing::Test {
 protected:
  using Known = std::map<std::pair<BodyId, std::uint32_t>, ProgramSample>;

  void SetUp() override {
    cluster_ = start_cluster(2);
    ASSERT_TRUE(cluster_.client);
    ASSERT_THAT(client().load(read_world("station.sdf")).status(), IsOk());
  }

  Client& client() { return *cluster_.client; }

  std::unique_ptr<ProgramStream> watch(const ProgramFilter& filter) {
    auto stream = client().watch_programs(filter, kPatience);
    EXPECT_THAT(stream.status(), IsOk());
    return stream.ok() ? *std::move(stream) : nullptr;
  }
  // Of the frames up to a tick.
  void read_until(Tick tick, ProgramStream& stream, Known& known) {
    for (Tick now = 0; now < tick;) {
      const absl::StatusOr<ProgramFrame> frame = stream.next(kPatience);
      ASSERT_THAT(frame.status(), IsOk());
      now = frame->tick;
      fewest_ = std::min(fewest_, frame->programs.size());
      for (const ProgramSample& sample : frame->programs) known[{sample.body, sample.program}] = sample;
    }
  }
  FoundPrograms asked() {
    QueryList queries;
    const auto place = queries.programs();
    return (*client().ask(queries, kPatience))[place];
  }

  Cluster cluster_;
  std::size_t fewest_ = 1000;  // programs of a frame
};

TEST_F(ProgramStreamTest, IsWhatQueriesTellWhoeverHostsTheBodies) {
  const std::unique_ptr<ProgramStream> stream = watch({});
  ASSERT_TRUE(stream);
  Known known;
  for (int times = 0; times < 10; ++times) {
    const Tick tick = client().step(30, kPatience).value();
    read_until(tick, *stream, known);
    const FoundPrograms now = asked();
    ASSERT_EQ(known.size(), now.programs.size());
    for (const FoundProgram& program : now.programs) {
      const ProgramSample& sample = known.at({program.body, program.program});
      EXPECT_EQ(sample.kind, program.kind);
      EXPECT_FALSE(sample.stopped);
      std::vector<double> values;
      for (const NamedNumber& number : program.values) values.push_back(number.value);
      EXPECT_EQ(sample.values, values) << program.body_name << " at tick " << tick;
    }
  }
  EXPECT_LT(fewest_, known.size()) << "what does not change is not told";
}

TEST_F(ProgramStreamTest, IsOfTheBodiesAndTheKindThatAreWanted) {
  const FoundPrograms all = asked();
  ASSERT_FALSE(all.programs.empty());
  const FoundProgram& one = all.programs.front();
  const auto known_of = [&](const ProgramFilter& filter) {
    const std::unique_ptr<ProgramStream> stream = watch(filter);
    Known known;
    if (stream) read_until(client().step(2, kPatience).value(), *stream, known);
    return known;
  };
  for (const auto& [place, sample] : known_of({.ids = {one.body}})) EXPECT_EQ(sample.body, one.body);
  const Known of_kind = known_of({.kind = "character", .every_ticks = 2});
  EXPECT_FALSE(of_kind.empty());
  for (const auto& [place, sample] : of_kind) EXPECT_EQ(sample.kind, "character");
}

}  // namespace
}  // namespace tessera
