// Contacts as bytes: what they were comes back, and what is not a contact is refused.
#include "lpss/native/contact.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace tessera::native {
namespace {

Contact some_contact() {
  Contact contact;
  contact.friction = Scalar(0.3);
  contact.restitution = Scalar(0.25);
  contact.is_found = true;
  contact.found_at.position = {1, 2, 3};
  for (int p = 0; p < 2; ++p) {
    ContactPatch& patch = contact.patches.emplace_back();
    patch.parts = (std::uint64_t{3} << 32) + static_cast<std::uint64_t>(p);
    patch.normal = {0, 0, 1};
    patch.fixed_normal = {0, 1, 0};
    patch.is_fixed_to_a = p == 1;
    patch.friction_impulse = {Scalar(0.1), Scalar(-0.2), 0};
    patch.twist_impulse = Scalar(0.01);
    patch.count = static_cast<std::uint8_t>(1 + p);
    for (int n = 0; n < patch.count; ++n) {
      patch.point[n] = {{1, Scalar(n), 0}, {0, Scalar(n), 1}, Scalar(-0.001), Scalar(2.5), 7u + n};
    }
  }
  return contact;
}

TEST(ContactBytesTest, ComeBackAsTheyWere) {
  const std::string bytes = encode(some_contact());
  Contact read;
  ASSERT_TRUE(decode(bytes, read));
  EXPECT_EQ(encode(read), bytes);
  ASSERT_EQ(read.patches.size(), 2u);
  EXPECT_EQ(read.patches[1].point[1].feature, 8u);
  EXPECT_EQ(read.patches[1].point[1].impulse, Scalar(2.5));
  EXPECT_EQ(read.found_at.position, Vector(1, 2, 3));
}

TEST(ContactBytesTest, AnyPrefixAndAnyMoreIsRefused) {
  const std::string bytes = encode(some_contact());
  Contact read;
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(decode(bytes.substr(0, length), read)) << length;
  }
  EXPECT_FALSE(decode(bytes + "x", read));
}

TEST(ContactBytesTest, SurfacesOfTheirOwnComeBackToo) {
  Contact contact = some_contact();
  contact.surface = std::make_shared<const ContactSurface>(
      ContactSurface{{1, 0, 0}, Scalar(0.5), Scalar(0.25), Scalar(0.1), Scalar(0.2), {1, 2, 3}, {4, 5, 6}});
  contact.patches[1].rolling_impulse = {7, 8, 9};
  const std::string bytes = encode(contact);
  Contact read;
  ASSERT_TRUE(decode(bytes, read));
  EXPECT_EQ(encode(read), bytes);
  ASSERT_TRUE(read.surface);
  EXPECT_EQ(read.surface->running, Vector(4, 5, 6));
  EXPECT_EQ(read.patches[1].rolling_impulse, Vector(7, 8, 9));
  for (std::size_t length = 0; length < bytes.size(); ++length)
    EXPECT_FALSE(decode(bytes.substr(0, length), read)) << length;
}

TEST(ContactBytesTest, MaterialsOfPatchesComeBackToo) {
  Contact contact = some_contact();
  ContactMaterial directed{Scalar(0.7), Scalar(0.1), ContactSurface{}};
  directed.surface->direction = {0, 1, 0};
  contact.materials = std::make_shared<const std::vector<ContactMaterial>>(
      std::vector<ContactMaterial>{{Scalar(0.5), Scalar(0.9), {}}, directed});
  contact.patches[1].rolling_impulse = {7, 8, 9};
  const std::string bytes = encode(contact);
  Contact read;
  ASSERT_TRUE(decode(bytes, read));
  EXPECT_EQ(encode(read), bytes);
  ASSERT_TRUE(read.materials);
  EXPECT_EQ(*read.materials, *contact.materials);
  EXPECT_EQ(read.material_of(0)->friction, Scalar(0.5));
  EXPECT_EQ(read.surface_of(0), nullptr);
  EXPECT_EQ(read.surface_of(1)->direction, Vector(0, 1, 0));
  EXPECT_EQ(read.material_of(2), nullptr);
  EXPECT_EQ(read.patches[1].rolling_impulse, Vector(7, 8, 9));
  for (std::size_t length = 0; length < bytes.size(); ++length)
    EXPECT_FALSE(decode(bytes.substr(0, length), read)) << length;
}

TEST(ContactBytesTest, AnotherPrecisionIsRefused) {
  std::string bytes = encode(some_contact());
  bytes[0] = static_cast<char>(sizeof(Scalar) == sizeof(float) ? sizeof(double) : sizeof(float));
  Contact read;
  EXPECT_FALSE(decode(bytes, read));
}

TEST(ContactBytesTest, TouchesWithAnOverlapOrAnImpulse) {
  Contact contact = some_contact();
  EXPECT_TRUE(contact.is_touching());
  for (ContactPatch& patch : contact.patches) {
    for (ContactPoint& point : patch.point) point.gap = Scalar(0.001);
  }
  EXPECT_TRUE(contact.is_touching());
  for (ContactPatch& patch : contact.patches) {
    for (ContactPoint& point : patch.point) point.impulse = 0;
  }
  EXPECT_FALSE(contact.is_touching());
}

}  // namespace
}  // namespace tessera::native
