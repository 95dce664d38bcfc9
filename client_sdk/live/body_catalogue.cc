#include "client_sdk/live/body_catalogue.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace tessera::live {
namespace {

constexpr absl::Duration kTimeout = absl::Seconds(5);
constexpr std::uint64_t kBodiesAsked = 100'000;  // per request: the coordinator's maximum

}  // namespace

void BodyCatalogue::clear() {
  bodies_.clear();
  shapes_.clear();
  statics_.clear();
}

void BodyCatalogue::add(FoundBodies found) {
  shapes_.merge(found.shapes);
  for (FoundBody& body : found.bodies) bodies_.insert_or_assign(body.id, std::move(body));
}

absl::Status BodyCatalogue::learn(std::span<const BodyId> ids) {
  BodyQuery query;
  std::copy_if(ids.begin(), ids.end(), std::back_inserter(query.ids),
               [&](BodyId id) { return !bodies_.contains(id); });
  if (query.ids.empty()) return absl::OkStatus();
  query.with_shapes = true;
  query.limit = query.ids.size();
  absl::StatusOr<FoundBodies> found = client_.find_bodies(query, kTimeout);
  if (!found.ok()) return found.status();
  add(*std::move(found));
  return absl::OkStatus();
}

absl::Status BodyCatalogue::learn_statics() {
  BodyQuery query;
  query.only_static = true;
  query.with_shapes = true;
  query.limit = kBodiesAsked;
  absl::StatusOr<FoundBodies> found = client_.find_bodies(query, kTimeout);
  if (!found.ok()) return found.status();
  statics_.clear();
  if (found->bodies.empty()) return absl::OkStatus();
  BodyFilter filter;
  for (const FoundBody& body : found->bodies) filter.ids.push_back(body.id);
  const absl::StatusOr<std::unique_ptr<BodyStream>> stream = client_.watch_bodies(filter, kTimeout);
  if (!stream.ok()) return stream.status();
  const absl::StatusOr<BodyFrame> frame = (*stream)->next(kTimeout);
  if (!frame.ok()) return frame.status();
  add(*std::move(found));
  for (const BodySample& sample : frame->bodies) {
    const double radius = bounding_radius(shape(find(sample.id)->properties.shape), Eigen::Vector3d::Zero());
    statics_.push_back({sample, radius});
  }
  return absl::OkStatus();
}

const FoundBody* BodyCatalogue::find(BodyId id) const {
  const auto found = bodies_.find(id);
  return found == bodies_.end() ? nullptr : &found->second;
}

}  // namespace tessera::live
