#include "lpss/tick/agreement.h"

#include <algorithm>
#include <initializer_list>
#include <tuple>
#include <utility>

#include "lpss/base/invariant.h"

namespace tessera {
namespace {

Rank parent_of(Rank rank) { return (rank - 1) / kTreeFan; }

template <typename T>
void append(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

// Where both ends of a joint are known, their servers are to be told of each other.
void match_joints(Agreement& said) {
  std::vector<JointEnd>& ends = said.joint_ends;
  const auto key = [](const JointEnd& end) { return std::minmax(end.body, end.tied); };
  std::sort(ends.begin(), ends.end(), [&](const JointEnd& a, const JointEnd& b) {
    return std::tuple(key(a), a.body, a.host) < std::tuple(key(b), b.body, b.host);
  });
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  std::vector<JointEnd> left;
  for (std::size_t n = 0; n < ends.size(); ++n) {
    if (n + 1 == ends.size() || key(ends[n]) != key(ends[n + 1])) {
      left.push_back(ends[n]);
      continue;
    }
    const JointEnd& a = ends[n];
    const JointEnd& b = ends[++n];
    if (a.host == b.host) continue;
    said.joint_hosts.push_back({a.host, b.body, b.host});
    said.joint_hosts.push_back({b.host, a.body, a.host});
  }
  ends = std::move(left);
}

}  // namespace

template <typename Visit>
void AgreementTree::for_each_below(Visit&& visit) const {
  for (std::size_t n = 1; n <= kTreeFan && std::size_t{kTreeFan} * self_ + n < servers_; ++n)
    visit(static_cast<Rank>(kTreeFan * self_ + n));
}

std::optional<Rank> AgreementTree::way_down(Rank to) const {
  while (to > self_ && parent_of(to) != self_) to = parent_of(to);
  if (to <= self_) return std::nullopt;
  return to;
}

Round AgreementTree::round() const { return make_round(RoundKind::kAgreement, servers_, number_); }

void AgreementTree::check(const Agreement& said) const {
  const auto are_servers = [&](std::initializer_list<Rank> ranks) {
    for (const Rank rank : ranks) invariant(rank < servers_, "an agreement is about servers of the world");
  };
  for (const Call& call : said.calls) are_servers({call.from, call.to});
  for (const JointEnd& end : said.joint_ends) are_servers({end.host});
  for (const JointHost& joint : said.joint_hosts) are_servers({joint.to, joint.host});
}

std::optional<Round> AgreementTree::begin(Rank self, std::size_t servers, Agreement mine,
                                          std::uint32_t number) {
  self_ = self;
  servers_ = servers;
  number_ = number;
  said_ = std::move(mine);
  stage_ = Stage::kGathering;
  Round gathering = round();
  bool any = false;
  for_each_below([&](Rank rank) { any = gathering.from[rank] = true; });
  if (any) return gathering;
  return ask();
}

std::optional<Round> AgreementTree::advance(std::vector<Agreement> inbox) {
  switch (stage_) {
    case Stage::kGathering:
      for_each_below([&](Rank rank) {
        const Agreement& below = inbox[rank];
        check(below);
        said_.quiet &= below.quiet;
        said_.goes_on |= below.goes_on;
        said_.has_programs |= below.has_programs;
        append(said_.calls, below.calls);
        append(said_.joint_ends, below.joint_ends);
        append(said_.joint_hosts, below.joint_hosts);
      });
      return ask();
    case Stage::kAsking: {
      const Agreement& all = inbox[parent_of(self_)];
      check(all);
      said_.quiet = all.quiet;
      said_.goes_on = all.goes_on;
      said_.has_programs = all.has_programs;
      append(said_.calls, all.calls);
      append(said_.joint_hosts, all.joint_hosts);
      return tell();
    }
    case Stage::kTelling:
      break;
  }
  return std::nullopt;
}

// What is for servers below stays here until all is known.
std::optional<Round> AgreementTree::ask() {
  match_joints(said_);
  if (self_ == 0) return tell();
  stage_ = Stage::kAsking;
  const auto is_for_here = [&](const auto& item) { return item.to == self_ || way_down(item.to); };
  Agreement up{.quiet = said_.quiet, .goes_on = said_.goes_on, .has_programs = said_.has_programs};
  const auto split = [&](auto& here, auto& there) {
    const auto others = std::stable_partition(here.begin(), here.end(), is_for_here);
    there.assign(others, here.end());
    here.erase(others, here.end());
  };
  split(said_.calls, up.calls);
  split(said_.joint_hosts, up.joint_hosts);
  up.joint_ends = std::exchange(said_.joint_ends, {});
  Round asking = round();
  asking.to[parent_of(self_)] = std::move(up);
  asking.from[parent_of(self_)] = true;
  return asking;
}

std::optional<Round> AgreementTree::tell() {
  stage_ = Stage::kTelling;
  Round telling = round();
  bool any = false;
  for_each_below([&](Rank rank) {
    any = true;
    telling.to[rank] =
        Agreement{.quiet = said_.quiet, .goes_on = said_.goes_on, .has_programs = said_.has_programs};
  });
  const auto hand_down = [&](auto Agreement::*items) {
    for (const auto& item : said_.*items) {
      if (const std::optional<Rank> way = way_down(item.to))
        (std::get<Agreement>(*telling.to[*way]).*items).push_back(item);
    }
    std::erase_if(said_.*items, [&](const auto& item) { return item.to != self_; });
  };
  hand_down(&Agreement::calls);
  hand_down(&Agreement::joint_hosts);
  said_.joint_ends.clear();
  if (!any) return std::nullopt;
  return telling;
}

}  // namespace tessera
