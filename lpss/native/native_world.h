// One sector's world: Tessera's own pipeline over Bullet's shapes.
//
// The bits of a step do not depend on history:
//   * Pairs are found by boxes that are functions of the bodies' states, and are looked at in the order of
//   ids.
//   * The points of a pair and what was found when travel with it (ManifoldState).
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/functional/function_ref.h>

#include <optional>
#include <vector>

#include "lpss/native/body.h"
#include "lpss/native/broad_phase.h"
#include "lpss/native/contact.h"
#include "lpss/native/flush_contacts.h"
#include "lpss/native/meetings.h"
#include "lpss/native/narrow_phase.h"
#include "lpss/native/native_engine.h"
#include "lpss/native/overlaps.h"

namespace tessera::native {

class NativeWorld final : public SectorWorld {
 public:
  explicit NativeWorld(NativeEngine& engine);
  NativeWorld(const NativeWorld&) = delete;
  NativeWorld& operator=(const NativeWorld&) = delete;

  BodySlot add(const BodyRecord& record, Role role) override;
  BodySlot add_static(BodyId id, const BodyProperties& properties, const Shape& part,
                      const Pose& pose) override;
  void remove(BodySlot slot) override;
  BodyState state(BodySlot slot) const override { return body(slot).state(); }
  void set_state(BodySlot slot, const BodyState& state) override;
  Eigen::Vector3d position(BodySlot slot) const override;
  Eigen::Vector3d linear_velocity(BodySlot slot) const override;
  Activity activity(BodySlot slot) const override { return body(slot).activity; }
  void set_velocity(BodySlot slot, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) override;
  void set_surface(BodySlot slot, const Surface& surface) override;
  void apply_impulse(BodySlot slot, const Eigen::Vector3d& impulse, const Eigen::Vector3d& lever) override;
  void add_wrench(BodySlot slot, const Wrench& wrench) override;
  void set_gravity(BodySlot slot, const Eigen::Vector3d& acceleration) override;
  void set_turning(BodySlot slot, const FrameTurn& turning) override;
  double surge(BodySlot slot) const override { return double(body(slot).surge); }
  void set_surge(BodySlot slot, double surge) override;
  void set_range(BodySlot slot, Range range) override { body(slot).range = range; }
  void set_jointed(BodySlot slot, bool jointed) override;
  void sleep(BodySlot slot) override;
  void wake(BodySlot slot) override;
  void rest() override;
  Eigen::AlignedBox3d swept_box(BodySlot slot, double dt) const override;
  void append_outside(const Eigen::AlignedBox3d& inside, double dt, std::vector<BodyOutside>& outside,
                      const ParallelFor& parallel) const override;
  bool reaches_home_body(const Eigen::AlignedBox3d& bounds, BodySlot& hint) const override;
  void detect(double dt, const ParallelFor& parallel) override;
  std::span<const ContactPair> contacts() override;
  std::vector<ContactDetail> touching_patches(std::size_t pair) const override;
  void find_overlaps(std::span<const Overlap> before, std::vector<Overlap>& now) override;
  bool has_triggers() const override { return !sensors_.empty(); }
  ManifoldState export_manifold(std::size_t pair) const override;
  void import_manifold(const ManifoldState& manifold) override;
  void append_numbers(BodySlot slot, std::string& bytes) const override;
  void append_pair_numbers(std::size_t pair, std::string& bytes) const override;
  bool take_solved(BodySlot slot, std::string_view& bytes) override;
  bool take_solved_pair(std::size_t pair, std::string_view& bytes) override;
  Wrench total_wrench(BodySlot slot) const override;
  void set_total_wrench(BodySlot slot, const Wrench& wrench) override;
  void fly(BodySlot slot, double dt) override;
  void set_mass(BodySlot slot, double mass, const std::array<double, 3>& moments) override;
  bool flew(BodySlot slot) const override { return body(slot).flies; }
  void end_flight(BodySlot slot, const Eigen::Vector3d& acceleration, double dt) override;
  std::vector<StoppedBody> integrate(double dt, const ParallelFor& parallel) override;
  std::optional<RayHit> raycast(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                const QueryFilter& filter) const override;
  std::vector<RayHit> raycast_all(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                  const QueryFilter& filter) const override;
  std::vector<NearBody> near(const Geometry& probe, const Pose& pose, double reach,
                             const QueryFilter& filter) const override;
  std::optional<ProbeHit> sweep(const Geometry& probe, const Pose& pose, const Eigen::Vector3d& direction,
                                double length, const QueryFilter& filter) const override;

  // For the solver.
  Body& body(BodySlot slot) { return bodies_[static_cast<std::size_t>(slot)]; }
  const Body& body(BodySlot slot) const { return bodies_[static_cast<std::size_t>(slot)]; }
  Contact& contact(std::size_t pair) { return contacts_[contact_of_pair_[pair]]; }
  const Contact& contact(std::size_t pair) const { return contacts_[contact_of_pair_[pair]]; }

 private:
  struct SweepHit {
    BodySlot other;
    Scalar fraction;         // of the way
    Vector way;              // m, of the swept body, relative to the other one
    Vector arm;              // m, from the centre of the swept body to that of the ball that hits, world axes
    Vector normal;           // on the other
    std::uint32_t part = 0;  // of the body that is swept
    const Part* met = nullptr;  // of the other one, if one of the two has parts with materials of their own
  };

  // Where bodies that live here may be in a tick.
  struct Homes {
    Bounds bounds = Bounds::nothing();  // holds their boxes and their ways
    Scalar way = 0;                     // m, that none of them exceeds
  };

  // What a loop over bodies notes of a piece of them.
  struct BodiesPiece {
    std::vector<BodySlot> left;  // their enlarged boxes
    std::vector<BodySlot> fast;  // to be swept
    std::vector<BodySlot> foreseen;
    std::vector<StoppedBody> stopped;
    std::vector<BodyOutside> outside;
    Homes homes;
  };

  // A candidate that is a contact of a body with one that nothing pushes.
  struct FixedCandidate {
    BodySlot body;
    BodySlot fixed;
    std::size_t candidate;  // its place
  };

  // What a loop over candidates notes of a piece of them.
  struct CandidatesPiece {
    NarrowPhase narrow_phase;
    std::vector<FixedCandidate> fixed;
    std::size_t kept = 0;                               // candidates, moved to the front of the piece
    std::vector<std::int32_t> dropped;                  // contacts
    std::vector<std::pair<std::size_t, Contact>> made;  // by the places of their candidates
    std::vector<ContactPair> pairs;
    std::vector<std::size_t> contact_of_pair;
    std::ptrdiff_t first_pair = 0;  // its place in the world's list
  };

  // What a loop over bodies with several of those contacts has for itself.
  struct FlushPiece {
    FlushContacts flush;
    std::vector<FixedContact> contacts;
  };

  // What a foreseen body is going to meet, after a share of the tick.
  struct Ahead {
    BodySlot other;
    Scalar share;
    Contact seen;
    Frame at;                 // of the body
    std::size_t patches = 0;  // of what was seen ...
    bool is_passed = false;   // ... some of which the body does not meet
  };

  // What a loop over foreseen bodies finds of a piece of them.
  struct MeetingsPiece {
    MeetingSearch search;
    FlushContacts flush;
    std::vector<BodySlot> near;
    std::vector<Ahead> ahead;
    std::vector<FixedContact> contacts;
    std::vector<FixedMeeting> fixed;
    Contact seen;
    std::vector<Meeting> meetings;
    std::vector<std::pair<BodySlot, Scalar>> stopped;  // after so large a share of the tick
  };

  BodySlot add(Body body);
  BodySlot add(const BodyRecord& record, Role role, const std::shared_ptr<const BodyForm>& form);
  void add_sensor(BodySlot slot, const std::shared_ptr<const BodyForm>& form, bool is_whole);
  bool reaches_sensor_of_home(const Bounds& bounds) const;
  bool may_be_in(const Body& visitor, const Body& trigger) const;
  bool is_in(BodySlot visitor, BodySlot trigger, std::span<const Overlap> before);
  Vector way_ahead(BodySlot slot) const;
  std::optional<BodySlot> slot_of(BodyId id) const;
  bool is_there(BodySlot slot) const { return body(slot).leaf != nullptr; }
  bool is_wanted(const Body& a, const Body& b) const;
  // With room for what loops note of each.
  Pieces pieces_of_bodies() const;
  Pieces pieces_of_candidates();
  void predict(Scalar dt, const ParallelFor& parallel);
  void predict(Body& body, Scalar dt) const;
  bool update_bounds(Body& body, Scalar dt) const;
  void set_bounds_to_pose(BodySlot slot) const;
  void refresh_bounds(const ParallelFor& parallel = {}) const;  // to the poses, if bodies have moved
  bool set_bounds(Body& body) const;
  Bounds swept(const Body& body, const Bounds& bounds, Scalar dt) const;
  Scalar bend(const Body& body, Scalar dt) const;
  Bounds bounds_on_way(const Body& body, bool turns) const;
  void note_home(const Body& body, Homes& homes) const;
  void update_contacts(const ParallelFor& parallel);
  void update_contacts(std::size_t begin, std::size_t end, CandidatesPiece& piece);
  void forget_removed();
  void update_contact(const Body& a, const Body& b, NarrowPhase& narrow_phase, Contact& contact) const;
  static void update_surface(const Body& a, const Body& b, Contact& contact);
  Contact blank_contact(const Body& a, const Body& b) const;
  std::int32_t keep_contact(Contact contact);
  void drop_contact(Candidate& candidate);
  Candidate& candidate_of(BodySlot a, BodySlot b);
  void gather(const ParallelFor& parallel);
  void join_flush(const ParallelFor& parallel);
  void thin_crowds();
  bool is_at_rest(const Body& a, const Body& b, const Contact& contact, const ContactScale& scale) const;
  void gather(std::size_t begin, std::size_t end, CandidatesPiece& piece) const;
  void predict_contacts(std::span<BodySlot> fast, const ParallelFor& parallel);
  std::span<BodySlot> noted(std::vector<BodySlot> BodiesPiece::*list, const Pieces& pieces);
  bool is_swept(const Body& body) const;   // it moves so far in this tick
  static bool moves_on(const Body& body);  // by its velocities, in this tick
  static std::optional<DivergenceKind> find_next(Body& body, double dt);
  void move_on(Body& body, double dt) const;
  void stop_at_obstacles(std::span<const BodySlot> fast, Scalar dt, const ParallelFor& parallel);
  Vector way_in_tick(const Body& body) const;  // m, as far as it is known
  std::optional<SweepHit> sweep(BodySlot swept, bool without_clones) const;
  void sweep(const Body& swept, const Vector& way, BodySlot other, std::optional<SweepHit>& hit) const;
  static void meet_faces(const Part& part, const Frame& at, const SweptBall& ball, SweepHit hit_at_end,
                         std::optional<SweepHit>& hit);
  void predict_contact(BodySlot swept, const SweepHit& hit);
  bool is_foreseen(const Body& body, Scalar dt) const;  // by its course, in this tick
  void predict_meetings(std::span<const BodySlot> foreseen, const ParallelFor& parallel);
  void find_meetings(BodySlot slot, MeetingsPiece& piece);
  void look_ahead(BodySlot slot, MeetingsPiece& piece);
  void join_ahead(BodySlot slot, MeetingsPiece& piece);
  void look_on(BodySlot slot, MeetingsPiece& piece);
  static bool swings_far(const Body& body, Scalar dt);
  static bool is_foreseen_by_velocity(const Body& body, Scalar dt);
  bool is_looked_after(const Body& body, Scalar dt) const;
  Scalar share_until_deep(BodySlot slot, MeetingsPiece& piece) const;
  void stop_turning(std::span<const BodySlot> turning, const ParallelFor& parallel);
  void for_each_piece_of(std::span<const BodySlot> foreseen, const ParallelFor& parallel,
                         absl::FunctionRef<void(MeetingsPiece&, std::size_t)> act);
  // What a query may meet on its way, in the order of ids.
  std::vector<BodySlot> bodies_along(const BoxOnWay& way, const QueryFilter& filter) const;
  Contact* contact_of(BodySlot a, BodySlot b);
  static void fly_turning(Body& flier, double dt);
  void keep_still_clock(Body& body, double dt) const;

  NativeEngine& engine_;
  const EngineSettings& settings_;
  mutable std::vector<Body> bodies_;  // by slot; without a leaf where free
  std::vector<BodySlot> free_slots_;
  std::vector<BodySlot> removed_;  // not free yet: candidates may refer to them
  absl::flat_hash_map<BodyId, BodySlot> slots_;
  mutable BroadPhase broad_phase_;
  mutable bool bounds_are_old_ = false;  // bodies have moved since, or boxes hold their way
  mutable Homes homes_;
  std::vector<Candidate> candidates_;  // ascending by ids
  std::vector<Contact> contacts_;
  std::vector<std::int32_t> free_contacts_;
  bool is_gathered_ = true;
  std::vector<ContactPair> pairs_;
  std::vector<std::size_t> contact_of_pair_;
  std::vector<std::uint32_t> pairs_of_body_;  // by slot, of two dynamic bodies
  std::vector<FixedCandidate> fixed_;
  std::vector<std::uint32_t> fixed_of_body_;  // by slot
  std::vector<BodySlot> sensors_;             // bodies with triggers, ascending by ids
  std::vector<BodySlot> kinematics_;          // in any order

  // Of loops, for their storage.
  mutable std::vector<BodiesPiece> bodies_pieces_;
  std::vector<CandidatesPiece> candidates_pieces_;
  std::vector<FlushPiece> flush_pieces_;
  std::vector<MeetingsPiece> meetings_pieces_;
  std::vector<BodySlot> noted_;
  std::vector<BodySlot> near_sensor_;
  OverlapSearch overlap_search_;
};

inline Body& body_of(const WorldBody& body) { return static_cast<NativeWorld*>(body.world)->body(body.slot); }

}  // namespace tessera::native
