#include "worlds/mjcf/contact_kinds.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>

namespace tessera::mjcf {
namespace {

constexpr std::size_t kBits = 32;
constexpr int kAny = -1;

// What decides with which others a geom collides.
struct GeomKind {
  int type = 1;
  int affinity = 1;
  int carrier = kAny;  // only where it is apart from another one
  int geom = kAny;     // only where pairs name it

  friend auto operator<=>(const GeomKind&, const GeomKind&) = default;
};

class Kinds {
 public:
  Kinds(const mjModel& model, const std::vector<int>& carriers, const Apart& apart, bool with_pairs)
      : apart_(apart) {
    std::set<int> special;
    for (const auto& [a, b] : apart) special.insert({a, b});
    std::set<int> paired;
    for (int n = 0; n < model.npair && with_pairs; ++n) {
      const std::pair<int, int> both = std::minmax(model.pair_geom1[n], model.pair_geom2[n]);
      pairs_.insert(both);
      paired.insert({both.first, both.second});
    }
    add(GeomKind{});  // others
    for (int n = 0; n < model.ngeom; ++n) {
      const int carrier = carriers[model.geom_bodyid[n]];
      of_geom_.push_back(add({model.geom_contype[n], model.geom_conaffinity[n],
                              special.contains(carrier) ? carrier : kAny, paired.contains(n) ? n : kAny}));
    }
    meet_.assign(kinds_.size(), std::vector<bool>(kinds_.size()));
    for (std::size_t a = 0; a < kinds_.size(); ++a) {
      for (std::size_t b = 0; b < kinds_.size(); ++b) meet_[a][b] = meets(kinds_[a], kinds_[b]);
    }
    group_kinds();
  }

  std::size_t groups() const { return members_.size(); }

  std::vector<ContactBits> bits() const {
    std::vector<ContactBits> result;
    for (const std::size_t kind : of_geom_) {
      const std::size_t group = group_of_[kind];
      ContactBits& own = result.emplace_back();
      for (std::size_t other = 0; other < kBits; ++other) {
        const std::size_t member = members_[other < members_.size() ? other : 0];
        if (meets_group(group, kind, member)) own.mask |= std::uint32_t{1} << other;
      }
      if (own.mask != 0) own.category = std::uint32_t{1} << group;
    }
    return result;
  }

 private:
  std::size_t add(const GeomKind& kind) {
    const auto [place, is_new] = places_.try_emplace(kind, kinds_.size());
    if (is_new) kinds_.push_back(kind);
    return place->second;
  }

  bool meets(const GeomKind& a, const GeomKind& b) const {
    if (a.geom != kAny && b.geom != kAny && pairs_.contains(std::minmax(a.geom, b.geom))) return true;
    if (a.carrier != kAny && b.carrier != kAny && apart_.contains(std::minmax(a.carrier, b.carrier)))
      return false;
    return (a.type & b.affinity) != 0 || (b.type & a.affinity) != 0;
  }

  // Geoms of one carrier do not collide anyway.
  bool is_alone(std::size_t kind) const { return kinds_[kind].carrier != kAny; }

  // Whether both collide alike with all others, and with each other as each with its like.
  bool are_alike(std::size_t a, std::size_t b) const {
    const bool both = meet_[a][b];
    if (!is_alone(a) && meet_[a][a] != both) return false;
    if (!is_alone(b) && meet_[b][b] != both) return false;
    for (std::size_t other = 0; other < kinds_.size(); ++other) {
      if (other != a && other != b && meet_[a][other] != meet_[b][other]) return false;
    }
    return true;
  }

  // A kind joins a group if it is like all of its members.
  void group_kinds() {
    std::vector<std::vector<std::size_t>> all;
    for (std::size_t kind = 0; kind < kinds_.size(); ++kind) {
      const auto group = std::ranges::find_if(all, [&](const std::vector<std::size_t>& members) {
        return std::ranges::all_of(members, [&](std::size_t member) { return are_alike(member, kind); });
      });
      group_of_.push_back(static_cast<std::size_t>(group - all.begin()));
      if (group == all.end()) {
        all.push_back({kind});
      } else {
        group->push_back(kind);
      }
    }
    for (const std::vector<std::size_t>& members : all) {
      members_.push_back(members.front());
      second_.push_back(members.size() > 1 ? members[1] : members.front());
    }
  }

  // With its own group, a kind meets as two of it meet each other.
  bool meets_group(std::size_t group, std::size_t kind, std::size_t member) const {
    if (group_of_[member] != group) return meet_[kind][member];
    if (members_[group] == second_[group]) return !is_alone(kind) && meet_[kind][kind];
    return meet_[members_[group]][second_[group]];
  }

  const Apart& apart_;
  std::set<std::pair<int, int>> pairs_;
  std::vector<GeomKind> kinds_;  // the first: that of others
  std::map<GeomKind, std::size_t> places_;
  std::vector<std::size_t> of_geom_;
  std::vector<std::vector<bool>> meet_;
  std::vector<std::size_t> group_of_;  // by kind
  std::vector<std::size_t> members_;   // the first of each group
  std::vector<std::size_t> second_;    // another one, if there is one
};

}  // namespace

std::vector<ContactBits> contact_bits(const mjModel& model, const std::vector<int>& carriers,
                                      const Apart& apart, Notices& notices) {
  if ((model.opt.disableflags & (mjDSBL_CONTACT | mjDSBL_CONSTRAINT)) != 0)
    return std::vector<ContactBits>(static_cast<std::size_t>(model.ngeom));
  // Their number decides how long it takes.
  constexpr std::size_t kSpecialMax = 512;
  if (apart.size() + static_cast<std::size_t>(model.npair) <= kSpecialMax) {
    const Kinds kinds(model, carriers, apart, true);
    if (kinds.groups() <= kBits) return kinds.bits();
  }
  notices.count_loss("contact exclusion or pair that would need more than 32 kinds of geoms, left out",
                     apart.size() + static_cast<std::size_t>(model.npair));
  const Apart none;
  const Kinds kinds(model, carriers, none, false);
  if (kinds.groups() <= kBits) return kinds.bits();
  notices.count_loss("contype and conaffinity of more than 32 kinds, left out: all geoms collide");
  return std::vector<ContactBits>(static_cast<std::size_t>(model.ngeom), ContactBits{1, 0xffffffff});
}

}  // namespace tessera::mjcf
