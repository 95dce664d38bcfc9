// Triggered publishers: what they wait for, and what they send.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <optional>
#include <string>
#include <vector>

#include "worlds/loader/xml.h"

namespace tessera::gazebo {

// One output of a triggered publisher.
struct Publication {
  std::string from;              // the topic that it waits for, as plain_topic() has it
  std::string field;             // of those messages, that counts; empty: any message does
  std::optional<double> wanted;  // what it must be; nothing: any message does
  double tolerance = 0;
  double delay = 0;             // s
  std::string at;               // the topic on which it sends
  std::string type;             // of what it sends, without the package: "Twist"
  std::vector<double> numbers;  // of that: a Twist has six; what has one number, or none, has one
};

// INVALID_ARGUMENT for what a relay cannot do, with what that is.
absl::StatusOr<std::vector<Publication>> publications_of(const xml::Element& plugin);

// As a text without ';', and back; nothing for what is no such text.
std::string to_text(const Publication& publication);
std::optional<Publication> publication_in(absl::string_view text);

// How topics are compared: "/model//box/detach" is "model/box/detach". In a model, "*" stands for its name.
std::string plain_topic(absl::string_view topic);

// "start" of "robot/start".
std::string last_word(absl::string_view topic);

// Tells a program that was written for a plugin, or for a sensor, on which topics others have its values and
// tell it something. `own` is the <plugin> or <sensor>, `model` the name of its model, "*" for that of the
// program.
void note_topics(const xml::Element& own, const std::string& model, xml::Element& program);

// The attributes for these.
inline constexpr char kSays[] = "says";
inline constexpr char kHears[] = "hears";
inline constexpr char kPublishes[] = "publishes";

}  // namespace tessera::gazebo
