// Bodies on several fixed surfaces that are flush with each other: tiles of a floor, parts of a compound,
// meshes and height fields that meet.
//
// A body that slides or rolls over two of them lies a little inside of the first one, and comes near the side
// of the second one, which the first one covers. Taken by itself, that side stops or throws the body. What
// tells a seam from a step is the second surface alone: at a step, it goes on above the plane of the contact
// with the first one.
#pragma once

#include <absl/container/inlined_vector.h>

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "lpss/native/body.h"
#include "lpss/native/contact.h"

namespace tessera::native {

// A contact of a body with one that nothing pushes.
struct FixedContact {
  const Body* body;
  const Body* fixed;
  Contact* contact;
};

// What a body is going to touch of one that nothing pushes, where it is then.
struct FixedMeeting {
  const Body* body;
  const Body* fixed;
  Contact* seen;
  Frame at;  // of the body
};

// For one thread at a time.
class FlushContacts {
 public:
  // Of all contacts that a body has with fixed ones, ascending by these: removes the patches of sides and
  // edges that do not stand out from what bears the body, and of patches in one plane the points that one
  // patch would not have. Contacts are springs: with twice the points, the body would rise at each seam.
  void join(std::span<const FixedContact> contacts);

  // Of all that one body is going to meet within a tick of `dt` seconds, ascending by the fixed ones: removes
  // the patches of what does not stand out from what bears the body, now or where it meets that; unless the
  // body comes down on it beside what bears it.
  void join(std::span<const FixedContact> contacts, std::span<const FixedMeeting> meetings, Scalar dt);

 private:
  using Points = absl::InlinedVector<collision::ContactPoint<Scalar>, 16>;

  // A patch. Vectors are relative to the centre of the body, in world axes.
  struct Touch {
    const Body* body;
    const Body* fixed;
    Contact* contact;
    Frame body_at;  // relative to its centre at the start
    std::size_t patch;
    const Part* part;  // of the fixed body
    const Part* part_of_body;
    Vector normal;     // to the body
    Scalar tolerance;  // m, within which others are flush
    Scalar least_gap;
    int count;
    Vector on_body[kPatchPointsMax];
    Vector on_fixed[kPatchPointsMax];
    Scalar level[kPatchPointsMax];  // m, along the normal, of the surface
    Scalar gap[kPatchPointsMax];
    bool is_lowest[kPatchPointsMax];  // where a round body is lowest
    bool is_kept[kPatchPointsMax];
    bool is_side;
    std::size_t plane;  // the first touch in the same plane

    // m, above the plane, as its point tells that is nearest.
    Scalar height(const Vector& at) const;
  };

  void look_at(const Body& body, const Body& fixed, Contact& contact, const Frame& at);
  void look_at(const FixedContact& contact);
  void find_sides(std::size_t first);
  void find_borne(std::size_t first);
  static bool comes_down(const Touch& bearing, Scalar dt);
  void find_planes();
  void share_points(std::size_t plane);
  void remove();
  static bool is_flush_side(const Touch& side, const Touch& bearing);
  static bool is_in_plane(const Touch& touch, const Touch& bearing);

  // Kept for their storage.
  std::vector<Touch> touches_;
  std::vector<std::pair<std::size_t, std::size_t>> sides_;  // and what they do not stand out from
};

}  // namespace tessera::native
