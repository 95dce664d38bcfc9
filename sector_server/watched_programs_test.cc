// Filters of programs.
#include "sector_server/watched_programs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const std::vector<ProgramRecord> kTwo = {
    {.kind = "imu", .values = {1, 2}}, {.kind = "flee@0123456789abcdef", .values = {3}, .fault = "stopped"}};

v1::ProgramBatch programs_for(const v1::WatchProgramsRequest& request) {
  const WatchedPrograms watched(request);
  v1::ProgramBatch batch;
  watched.add_those_of({BodyId{4}, kTwo}, batch);
  watched.add_those_of({BodyId{7}, kTwo}, batch);
  return batch;
}

v1::ProgramBatch of_kind(const char* kind) {
  v1::WatchProgramsRequest request;
  request.set_kind(kind);
  return programs_for(request);
}

TEST(WatchedPrograms, WithoutAFilterAreAll) {
  const v1::ProgramBatch all = programs_for({});
  EXPECT_THAT(all.kinds(), ElementsAre("imu", "flee@0123456789abcdef"));
  EXPECT_THAT(all.bodies(), ElementsAre(4, 4, 7, 7));
  EXPECT_THAT(all.programs(), ElementsAre(0, 1, 0, 1));
  EXPECT_THAT(all.kind(), ElementsAre(0, 1, 0, 1));
  EXPECT_THAT(all.counts(), ElementsAre(2, 1, 2, 1));
  EXPECT_THAT(all.stopped(), ElementsAre(false, true, false, true));
  EXPECT_THAT(all.values(), ElementsAre(1, 2, 3, 1, 2, 3));
}

TEST(WatchedPrograms, AreThoseOfTheBodies) {
  v1::WatchProgramsRequest request;
  request.add_ids(7);
  request.add_ids(5);
  EXPECT_THAT(programs_for(request).bodies(), ElementsAre(7, 7));
}

TEST(WatchedPrograms, AreOfTheKindWithOrWithoutTheChecksumOfItsModule) {
  EXPECT_THAT(of_kind("imu").programs(), ElementsAre(0, 0));
  EXPECT_THAT(of_kind("flee").programs(), ElementsAre(1, 1));
  EXPECT_THAT(of_kind("flee@0123456789abcdef").programs(), ElementsAre(1, 1));
  EXPECT_THAT(of_kind("flee@").programs(), IsEmpty());
  EXPECT_THAT(of_kind("im").programs(), IsEmpty());
}

}  // namespace
}  // namespace tessera
