#include "worlds/gazebo/publication.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/str_split.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "worlds/gazebo/message_text.h"
#include "worlds/gazebo/numbers.h"

namespace tessera::gazebo {
namespace {

using xml::Element;

constexpr double kMillisecond = 1e-3;
constexpr std::array kOfTwist = {"linear.x", "linear.y", "linear.z", "angular.x", "angular.y", "angular.z"};

// "gz.msgs.Twist" without the package.
std::string short_type(const Element& element) {
  const std::string type = xml::attribute_of(&element, "type");
  return type.substr(type.rfind('.') + 1);
}

absl::Status refused(absl::string_view why) { return absl::InvalidArgumentError(why); }

// What an input waits for.
absl::StatusOr<Publication> awaited(const Element& input) {
  Publication publication;
  publication.from = plain_topic(xml::attribute_of(&input, "topic"));
  if (publication.from.empty()) return refused("its <input> has no topic");
  const Element* const match = input.FirstChildElement("match");
  if (match == nullptr) return publication;
  if (match->NextSiblingElement("match") != nullptr) return refused("it has more than one <match>");
  if (xml::attribute_of(match, "logic_type") == "negative") return refused("its <match> is negative");
  const std::string text = xml::text_of(*match);
  publication.field = xml::attribute_of(match, "field");
  if (!publication.field.empty()) {
    publication.wanted = number_of_text(text);
    if (match->Attribute("tol") != nullptr) {
      const absl::StatusOr<double> tolerance = xml::number_attribute(*match, "tol");
      if (!tolerance.ok()) return tolerance.status();
      publication.tolerance = std::abs(*tolerance);
    }
  } else {
    const absl::StatusOr<MessageFields> fields = read_message_text(text);
    if (!fields.ok()) return fields.status();
    // The detector of performers has what happened in a header.
    const bool is_of_header = fields->size() == 2 && (*fields)[0].first == "header.data.key" &&
                              (*fields)[1].first == "header.data.value";
    if (!is_of_header && fields->size() != 1) return refused("its <match> has more than one field");
    publication.field = is_of_header ? (*fields)[0].second : (*fields)[0].first;
    publication.wanted = number_of_text(fields->back().second);
  }
  if (!publication.wanted) return refused("its <match> is no number");
  return publication;
}

// The numbers of what an output sends.
absl::StatusOr<std::vector<double>> sent(const Element& output) {
  const absl::StatusOr<MessageFields> fields = read_message_text(xml::text_of(output));
  if (!fields.ok()) return fields.status();
  const std::string type = short_type(output);
  std::vector<double> numbers;
  if (type == "Empty") {
    numbers = {1};
  } else if (type == "Twist") {
    for (const char* name : kOfTwist) numbers.push_back(number_in(*fields, name).value_or(0));
  } else if (type == "Boolean" || type == "Double" || type == "Float" || type == "Int32") {
    numbers = {number_in(*fields, "data").value_or(0)};
  } else {
    return refused(absl::StrCat("it sends a ", type, ", which no program hears"));
  }
  return numbers;
}

// One of these children, or else `otherwise`.
std::string topic_of(const Element& own, std::initializer_list<const char*> spellings,
                     const std::string& otherwise) {
  std::string topic = text_of_any(own, spellings);
  return topic.empty() ? otherwise : topic;
}

// What a program of a system is told on; empty: nothing.
std::string heard_by(const Element& own, const Element& program, absl::string_view kind) {
  if (kind == "diff_drive" || kind == "ackermann" || kind == "treads" || kind == "velocity_control")
    return topic_of(own, {"topic", "commandTopic", "command_topic"}, "model/*/cmd_vel");
  if (kind == "multicopter") {
    const std::string space = topic_of(own, {"robotNamespace"}, "model/*");
    return absl::StrCat(space, "/", topic_of(own, {"commandSubTopic"}, "cmd_vel"));
  }
  if (kind == "breaker") return topic_of(own, {"detach_topic", "topic"}, "model/*/detachable_joint/detach");
  if (kind == "belt") return topic_of(own, {"velocity_topic"}, "");
  if (kind != "pid") return "";
  const std::string below = text_of_any(own, {"sub_topic"});
  const bool is_of_rate = xml::attribute_of(&program, "of_rate") == "1";
  const std::string joint = xml::attribute_of(&program, "joint");
  return topic_of(own, {"topic"},
                  !below.empty()
                      ? absl::StrCat("model/*/", below)
                      : absl::StrCat("model/*/joint/", joint, is_of_rate ? "/cmd_vel" : "/0/cmd_pos"));
}

// On what a program has its values.
std::string said_by(const Element& own, absl::string_view kind) {
  if (xml::is(own, "sensor")) {
    const Element* const contact = own.FirstChildElement("contact");
    if (kind == "touch" && contact != nullptr)
      return topic_of(own, {"topic"}, xml::child_text(*contact, "topic"));
    return topic_of(own, {"topic"}, "");
  }
  if (kind == "touch") return absl::StrCat(topic_of(own, {"namespace"}, ""), "/touched");
  if (kind == "pad") return topic_of(own, {"topic"}, "performer_detector");
  if (kind == "pose") return topic_of(own, {"odom_topic", "topicName"}, "model/*/odometry");
  return "";
}

void set_topic(const std::string& topic, const char* attribute, Element& program) {
  const std::string plain = plain_topic(topic);
  if (!plain.empty() && !absl::StrContains(plain, ';')) program.SetAttribute(attribute, plain.c_str());
}

}  // namespace

std::string last_word(absl::string_view topic) { return std::string(topic.substr(topic.rfind('/') + 1)); }

std::string plain_topic(absl::string_view topic) {
  return absl::StrJoin(absl::StrSplit(topic, '/', absl::SkipEmpty()), "/");
}

absl::StatusOr<std::vector<Publication>> publications_of(const Element& plugin) {
  const Element* const input = plugin.FirstChildElement("input");
  if (input == nullptr) return refused("it has no <input>");
  absl::StatusOr<Publication> publication = awaited(*input);
  if (!publication.ok()) return publication.status();
  Numbers numbers;
  publication->delay = kMillisecond * numbers.read(plugin, "delay_ms", 0);
  if (!numbers.status().ok()) return numbers.status();
  if (plugin.FirstChildElement("service") != nullptr) return refused("it calls a <service>");
  std::vector<Publication> publications;
  for (const Element* output = plugin.FirstChildElement("output"); output != nullptr;
       output = output->NextSiblingElement("output")) {
    absl::StatusOr<std::vector<double>> values = sent(*output);
    if (!values.ok()) return values.status();
    Publication& one = publications.emplace_back(*publication);
    one.at = plain_topic(xml::attribute_of(output, "topic"));
    one.type = short_type(*output);
    one.numbers = *std::move(values);
    if (one.at.empty()) return refused("its <output> has no topic");
    for (const std::string* word : {&one.from, &one.field, &one.at, &one.type}) {
      if (word->find_first_of(";|") != std::string::npos)
        return refused(absl::StrCat("'", *word, "' has a ; or |"));
    }
  }
  if (publications.empty()) return refused("it has no <output>");
  return publications;
}

std::string to_text(const Publication& publication) {
  std::vector<std::string> words = {publication.from, publication.field, publication.at, publication.type,
                                    publication.wanted ? absl::StrFormat("%.17g", *publication.wanted) : ""};
  for (const double number : {publication.tolerance, publication.delay})
    words.push_back(absl::StrFormat("%.17g", number));
  for (const double number : publication.numbers) words.push_back(absl::StrFormat("%.17g", number));
  return absl::StrJoin(words, "|");
}

std::optional<Publication> publication_in(absl::string_view text) {
  const std::vector<std::string> words = absl::StrSplit(text, '|');
  constexpr std::size_t kNumbers = 7;  // the place of the first one that is sent
  if (words.size() <= kNumbers) return std::nullopt;
  Publication publication{words[0], words[1], number_of_text(words[4]), 0, 0, words[2], words[3], {}};
  publication.tolerance = number_of_text(words[5]).value_or(0);
  publication.delay = number_of_text(words[6]).value_or(0);
  for (std::size_t n = kNumbers; n < words.size(); ++n)
    publication.numbers.push_back(number_of_text(words[n]).value_or(0));
  return publication;
}

void note_topics(const Element& own, const std::string& model, Element& program) {
  const std::string kind = xml::attribute_of(&program, "kind");
  set_topic(absl::StrReplaceAll(heard_by(own, program, kind), {{"*", model}}), kHears, program);
  set_topic(absl::StrReplaceAll(said_by(own, kind), {{"*", model}}), kSays, program);
}

}  // namespace tessera::gazebo
