#include "ros/bridge.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>

#include <algorithm>

#include "ros/names.h"

namespace tessera::ros {
namespace {

// How surely an entry means a topic.
enum class Fit { kNone, kOnlyOne, kSameEnd, kAsInGazebo, kSameName };

using Words = std::vector<std::string>;

bool has_word(const Words& words, const std::string& name) {
  return std::ranges::any_of(words, [&](const std::string& word) { return topic_word(word) == name; });
}

// Of ".../sensor/front/scan", whether it is of the sensor "front".
bool is_of_sensor(const Words& words, const std::string& sensor) {
  const auto place = std::ranges::find(words, "sensor");
  return !sensor.empty() && place != words.end() && place + 1 != words.end() &&
         topic_word(*(place + 1)) == sensor;
}

Fit fit_of(const BridgeEntry& entry, const OwnTopic& topic, const std::set<std::string>& models) {
  const bool has_flow = topic.flow == Flow::kToRos ? entry.is_to_ros : entry.is_from_ros;
  if (!has_flow || entry.type != topic.type) return Fit::kNone;
  if (entry.gz_topic == topic.topic) return Fit::kSameName;
  const Words words = absl::StrSplit(entry.gz_topic, '/', absl::SkipEmpty());
  const std::string own = topic_word(topic.model);
  const bool is_of_model = !topic.model.empty() && has_word(words, own);
  const bool is_of_another = !is_of_model && std::ranges::any_of(models, [&](const std::string& model) {
    return has_word(words, topic_word(model));
  });
  // "/model/X/..." is of X, even where there is no such model.
  if (is_of_another || (!is_of_model && !topic.model.empty() && words.size() > 1 && words[0] == "model"))
    return Fit::kNone;
  if (is_of_model && is_of_sensor(words, topic.sensor)) return Fit::kAsInGazebo;
  for (const std::string& name : topic.names) {
    if (entry.gz_topic == absl::StrCat("/model/", topic.model, "/", name)) return Fit::kAsInGazebo;
  }
  for (const std::string& name : topic.names) {
    const bool is_same = absl::StartsWith(name, "/")
                             ? entry.gz_topic == name
                             : absl::EndsWith(entry.gz_topic, absl::StrCat("/", name));
    if (is_same) return Fit::kSameEnd;
  }
  return topic.is_only_one ? Fit::kOnlyOne : Fit::kNone;
}

}  // namespace

std::string ros_type(absl::string_view dds_type) {
  return absl::StrReplaceAll(absl::StripSuffix(dds_type, "_"), {{"::dds_::", "/"}, {"::", "/"}});
}

const BridgeEntry* Bridge::find(const OwnTopic& topic, const std::set<std::string>& models) {
  const BridgeEntry* best = nullptr;
  Fit fit = Fit::kNone;
  for (const BridgeEntry& entry : entries_) {
    const Fit other = fit_of(entry, topic, models);
    if (other <= fit) continue;
    best = &entry;
    fit = other;
  }
  if (best != nullptr) used_.insert(best);
  return best;
}

bool Bridge::has_ros_topic(absl::string_view topic) const {
  return std::ranges::find(entries_, topic, &BridgeEntry::ros_topic) != entries_.end();
}

std::vector<std::string> Bridge::take_unused() {
  std::vector<std::string> unused;
  for (const BridgeEntry& entry : entries_) {
    if (used_.contains(&entry) || !told_.insert(&entry).second) continue;
    unused.push_back(absl::StrCat(entry.where, ": nothing in this world is ", entry.gz_topic, " of type ",
                                  entry.type, ": ", entry.ros_topic, " is not bridged"));
  }
  return unused;
}

}  // namespace tessera::ros
