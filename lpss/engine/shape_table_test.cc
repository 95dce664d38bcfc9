#include "lpss/engine/shape_table.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace tessera {
namespace {

struct Form {
  Form(const Shape& shape, const Pose& /*centre*/, bool /*is_static*/) : parts(shape.parts.size()) {}

  std::size_t parts;
};

BodyProperties of_shape(ShapeId shape) {
  BodyProperties properties;
  properties.shape = shape;
  return properties;
}

TEST(ShapeTable, BodiesOfAShapeShareItsForm) {
  ShapeTable<Form> table;
  table.add(0, Shape{{ShapePart{Box{}, {}}}});
  const auto one = table.of(of_shape(0));
  EXPECT_EQ(one, table.of(of_shape(0)));
  BodyProperties moved = of_shape(0);
  moved.centre[2] = 1;
  EXPECT_NE(one, table.of(moved));
  EXPECT_EQ(one->parts, 1u);
}

TEST(ShapeTable, FormsWithoutBodiesAreForgotten) {
  constexpr ShapeId kInUse = 10;
  constexpr ShapeId kAll = 5000;
  ShapeTable<Form> table;
  std::vector<std::shared_ptr<const Form>> used;
  for (ShapeId shape = 0; shape < kAll; ++shape) {
    table.add(shape, Shape{{ShapePart{Sphere{1.0 + shape}, {}}}});
    const std::shared_ptr<const Form> form = table.of(of_shape(shape));
    if (shape < kInUse) used.push_back(form);
    EXPECT_LE(table.built_count(), ShapeTable<Form>::kUnusedMax);
  }
  for (ShapeId shape = 0; shape < kInUse; ++shape) EXPECT_EQ(used[shape], table.of(of_shape(shape)));
  EXPECT_EQ(table.of(of_shape(kAll / 2))->parts, 1u);  // made anew
}

}  // namespace
}  // namespace tessera
