#include "viewer/ground_request.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <utility>
#include <vector>

#include "viewer/json.h"
#include "viewer/page_requests.h"
#include "viewer/page_view.h"

namespace tessera::viewer {
namespace {

using nlohmann::json;
using Hits = std::vector<std::optional<FirstHit>>;

// From -1 to 1, denser towards 0.
double share(int n) {
  const double linear = 2.0 * n / (kGroundSide - 1) - 1;
  return linear * std::abs(linear);
}

absl::StatusOr<RaysQuery> rays_down(const WorldPosition& centre, const Eigen::Vector3d& up, double half,
                                    double sector_size) {
  const Eigen::Vector3d side = up.unitOrthogonal();
  const Eigen::Vector3d ahead = up.cross(side);
  RaysQuery query;
  for (int row = 0; row < kGroundSide; ++row) {
    for (int column = 0; column < kGroundSide; ++column) {
      const Eigen::Vector3d from =
          centre.local + half * (share(column) * side + share(row) * ahead) + kGroundDepth * up;
      const absl::StatusOr<WorldPosition> origin = canonical(centre.sector, from, sector_size);
      if (!origin.ok()) return origin.status();
      query.rays.push_back({*origin, -up, 2 * kGroundDepth});
    }
  }
  return query;
}

absl::StatusOr<Hits> cast(Client& client, const RaysQuery& rays) {
  QueryList queries;
  const auto place = queries.rays(rays);
  const absl::StatusOr<Answers> answers = client.ask(queries, kRequestTimeout);
  if (!answers.ok()) return answers.status();
  return (*answers)[place];
}

// Casts those rays again that something else than the ground was in the way of, past that.
absl::Status look_past(Client& client, BodyId ground, const RaysQuery& rays, Hits& hits) {
  RaysQuery again;
  std::vector<std::size_t> places;
  for (std::size_t n = 0; n < hits.size(); ++n) {
    if (!hits[n] || hits[n]->body == ground) continue;
    places.push_back(n);
    again.rays.push_back(rays.rays[n]);
    again.rays.back().except = hits[n]->body;
    hits[n].reset();
  }
  if (places.empty()) return absl::OkStatus();
  const absl::StatusOr<Hits> found = cast(client, again);
  if (!found.ok()) return found.status();
  for (std::size_t n = 0; n < places.size(); ++n) {
    if ((*found)[n] && (*found)[n]->body == ground) hits[places[n]] = (*found)[n];
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<json> ground(Client& client, const live::ClusterReport& report, const json& request) {
  if (!report.cluster.settings) return absl::FailedPreconditionError("no world is loaded");
  const double sector_size = report.cluster.settings->sector_size;
  const absl::StatusOr<WorldPosition> centre = position_from(request);
  if (!centre.ok()) return centre.status();
  const absl::StatusOr<std::uint64_t> body = natural_from(request.at("body"));
  if (!body.ok()) return absl::InvalidArgumentError(absl::StrCat("body: ", body.status().message()));
  const double half = request.at("half").get<double>();
  if (!(half >= kGroundHalfMin && half <= kGroundHalfMax)) {
    return absl::InvalidArgumentError(
        absl::StrCat("half: ", half, " m is not ", kGroundHalfMin, " to ", kGroundHalfMax, " m"));
  }
  if (centre->sector.frame > report.cluster.settings->frames.size())
    return absl::NotFoundError(absl::StrCat("frame: the world has no frame ", centre->sector.frame));
  const Eigen::Vector3d up = PageView({*centre, half}, *report.cluster.settings).up(report.cluster.tick);
  const absl::StatusOr<RaysQuery> rays = rays_down(*centre, up, half, sector_size);
  if (!rays.ok()) return rays.status();
  absl::StatusOr<Hits> hits = cast(client, *rays);
  if (!hits.ok()) return hits.status();
  if (absl::Status status = look_past(client, BodyId{*body}, *rays, *hits); !status.ok()) return status;
  json points = json::array();
  for (const std::optional<FirstHit>& hit : *hits) {
    if (hit) {
      const Eigen::Vector3d point = relative_to(hit->position, centre->sector, sector_size);
      for (const double coordinate : point) points.push_back(static_cast<float>(coordinate));
    } else {
      for (int axis = 0; axis < 3; ++axis) points.push_back(nullptr);
    }
  }
  return json{{"side", kGroundSide}, {"points", std::move(points)}};
}

}  // namespace tessera::viewer
