// Sectors with all that is kept of them, compared bit for bit.
#pragma once

#include <gtest/gtest.h>

#include "lpss/partition/moved_sector.h"
#include "lpss/partition/test_partition.h"

namespace tessera {

inline void expect_equal(const MovedSector& a, const MovedSector& b) {
  EXPECT_EQ(a.sector, b.sector);
  ASSERT_EQ(a.bodies.size(), b.bodies.size());
  for (std::size_t n = 0; n < a.bodies.size(); ++n) {
    const MovedBody& x = a.bodies[n];
    const MovedBody& y = b.bodies[n];
    EXPECT_EQ(x.record.id, y.record.id);
    EXPECT_EQ(x.record.home, y.record.home);
    EXPECT_EQ(x.record.properties.motion, y.record.properties.motion);
    EXPECT_EQ(bits(x.record.state), bits(y.record.state));
    EXPECT_EQ(x.replicated_in, y.replicated_in);
    EXPECT_EQ(x.known_everywhere, y.known_everywhere);
    EXPECT_EQ(x.next_home, y.next_home);
    ASSERT_EQ(x.kinematic_target.has_value(), y.kinematic_target.has_value());
    if (x.kinematic_target) {
      EXPECT_EQ(bits(*x.kinematic_target), bits(*y.kinematic_target));
    }
    EXPECT_EQ(x.dirty, y.dirty);
    EXPECT_EQ(x.joints.as_parent, y.joints.as_parent);
    ASSERT_EQ(x.joints.as_child.size(), y.joints.as_child.size());
    for (std::size_t m = 0; m < x.joints.as_child.size(); ++m) {
      EXPECT_EQ(tie_of(x.joints.as_child[m].record), tie_of(y.joints.as_child[m].record));
      EXPECT_EQ(x.joints.as_child[m].record.drives, y.joints.as_child[m].record.drives);
      EXPECT_EQ(x.joints.as_child[m].coupled, y.joints.as_child[m].coupled);
    }
  }
  ASSERT_EQ(a.clones.size(), b.clones.size());
  for (std::size_t n = 0; n < a.clones.size(); ++n) {
    const MovedClone& x = a.clones[n];
    const MovedClone& y = b.clones[n];
    EXPECT_EQ(x.introduction.id, y.introduction.id);
    EXPECT_EQ(x.update.home, y.update.home);
    EXPECT_EQ(x.update.next_home, y.update.next_home);
    EXPECT_EQ(x.update.replicated_in, y.update.replicated_in);
    EXPECT_EQ(x.update.known_everywhere, y.update.known_everywhere);
    EXPECT_EQ(x.update.jointed, y.update.jointed);
    EXPECT_EQ(bits(x.update.state), bits(y.update.state));
    EXPECT_EQ(x.placed, y.placed);
    EXPECT_EQ(x.fresh, y.fresh);
  }
  ASSERT_EQ(a.manifolds.size(), b.manifolds.size());
  for (std::size_t n = 0; n < a.manifolds.size(); ++n) {
    EXPECT_EQ(a.manifolds[n].a, b.manifolds[n].a);
    EXPECT_EQ(a.manifolds[n].b, b.manifolds[n].b);
    EXPECT_EQ(a.manifolds[n].points, b.manifolds[n].points);
  }
  EXPECT_EQ(a.touching, b.touching);
  EXPECT_EQ(a.overlaps, b.overlaps);
  EXPECT_EQ(a.static_region, b.static_region);
  EXPECT_EQ(a.parts_reported, b.parts_reported);
  EXPECT_EQ(a.active, b.active);
}

}  // namespace tessera
