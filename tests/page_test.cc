// A cluster with the web UI, from the command line.
#include <absl/strings/str_cat.h>
#include <signal.h>

#include <algorithm>

#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(PageTest, UpWithAWorldNamesItsPageAndEndsWithIt) {
  Process up("tessera", {"up", world_file("tower.sdf").string(), "--shift", "2^62,0,0", "--listen",
                         "127.0.0.1:0", "--page", "127.0.0.1:0"});
  ASSERT_TRUE(up.await_output("11 bodies in 1 sectors, paused")) << up.output();
  EXPECT_THAT(up.output(), HasSubstr("see it in a browser: http://127.0.0.1:"));
  Processes children(children_of(up.process().pid()));
  EXPECT_EQ(children.ids().size(), 4u);  // coordinator, two servers, web UI
  up.process().signal(SIGINT);
  EXPECT_EQ(up.wait(), kSignalled + SIGINT) << up.output();
  EXPECT_TRUE(children.await_end());
}

TEST(PageTest, ClusterGoesOnWithoutItsPage) {
  Process up("tessera", {"up", "--listen", "127.0.0.1:0", "--page", "127.0.0.1:0"});
  ASSERT_TRUE(up.await_output("try: tessera load")) << up.output();
  const std::vector<pid_t> children = children_of(up.process().pid());
  ASSERT_EQ(children.size(), 4u);
  const auto page = std::find_if(children.begin(), children.end(),
                                 [](pid_t child) { return name_of(child) == "tessera-viewer"; });
  ASSERT_NE(page, children.end());
  kill(*page, SIGKILL);
  ASSERT_TRUE(up.await_output("the cluster continues: the web UI is lost: tessera-viewer")) << up.output();
  up.process().signal(SIGINT);
  EXPECT_EQ(up.wait(), kSignalled + SIGINT) << up.output();
}

TEST(PageTest, PortInUseIsAnErrorOnlyWhereItWasAskedFor) {
  Process first("tessera", {"up", "--listen", "127.0.0.1:0", "--page", "127.0.0.1:0"});
  ASSERT_TRUE(first.await_output("try: tessera load")) << first.output();
  const std::string output = first.output();
  const std::size_t at = output.find("http://") + 7;
  const std::string address = output.substr(at, output.find('/', at) - at);

  Process second("tessera", {"up", "--listen", "127.0.0.1:0", "--page", address});
  EXPECT_EQ(second.wait(), 1);
  EXPECT_THAT(second.output(), HasSubstr(absl::StrCat("cannot listen on ", address)));

  Process third("tessera", {"up", "--listen", "127.0.0.1:0", "--no-page"});
  ASSERT_TRUE(third.await_output("try: tessera load")) << third.output();
  EXPECT_THAT(third.output(), Not(HasSubstr("http://")));
}

}  // namespace
}  // namespace tessera
