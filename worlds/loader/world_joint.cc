#include "worlds/loader/world_joint.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_replace.h>

#include <Eigen/Core>
#include <sdf/Model.hh>
#include <sdf/Root.hh>
#include <utility>

#include "worlds/loader/elements.h"
#include "worlds/loader/sdf_parser.h"

namespace tessera {
namespace {

using xml::Element;

// The links of the model that a joint is put into, since libsdformat reads joints in models only.
constexpr char kParent[] = "tessera:parent";
constexpr char kChild[] = "tessera:child";

Element& model_around(Element& joint) {
  Element& world = *joint.Parent()->ToElement();
  Element& model = *world.InsertNewChildElement("model");
  model.SetAttribute("name", kAnyModel);
  for (const auto& [end, link] : {std::pair{"parent", kParent}, std::pair{"child", kChild}}) {
    model.InsertNewChildElement("link")->SetAttribute("name", link);
    joint.FirstChildElement(end)->SetText(link);
  }
  if (Element* pose = joint.FirstChildElement("pose")) joint.DeleteChild(pose);
  model.InsertEndChild(&joint);
  return model;
}

}  // namespace

absl::Status express_axes(
    Element& joint, const Eigen::Quaterniond& orientation,
    absl::FunctionRef<absl::StatusOr<WorldPose>(const Element&, const std::string&)> frame_named) {
  for (const char* name : {"axis", "axis2"}) {
    Element* const axis = joint.FirstChildElement(name);
    Element* const xyz = axis == nullptr ? nullptr : axis->FirstChildElement("xyz");
    const char* const frame = xyz == nullptr ? nullptr : xyz->Attribute("expressed_in");
    if (frame == nullptr || *frame == '\0') continue;
    const absl::StatusOr<WorldPose> pose = frame_named(*xyz, frame);
    if (!pose.ok()) return pose.status();
    const absl::StatusOr<Eigen::Vector3d> direction = xml::vector_in(*xyz, xml::text_of(*xyz));
    if (!direction.ok()) return direction.status();
    const Eigen::Vector3d own = orientation.conjugate() * (pose->orientation * *direction);
    xyz->SetText(absl::StrFormat("%.17g %.17g %.17g", own.x(), own.y(), own.z()).c_str());
    xyz->DeleteAttribute("expressed_in");
  }
  return absl::OkStatus();
}

absl::StatusOr<std::optional<JointKind>> read_world_joint(Element& joint, const std::string& version,
                                                          const std::filesystem::path& directory,
                                                          ModelSources& sources, Notices& notices) {
  const std::string parent = xml::child_text(joint, "parent");
  const std::string child = xml::child_text(joint, "child");
  absl::StatusOr<ModelSource> source = sources.prepare(model_around(joint), version, directory);
  if (!source.ok()) return source.status();
  notices.add(source->notices);
  sdf::Root root;
  absl::Status status = parse_sdf(source->document(std::nullopt), root, notices);
  if (status.ok() && (root.Model() == nullptr || root.Model()->JointCount() != 1)) {
    status = absl::InvalidArgumentError("libsdformat reads no joint here");
  }
  if (!status.ok()) {
    // By the names of the file.
    return xml::error_at(
        joint, status.code(),
        absl::StrReplaceAll(status.message(), {{kParent, parent}, {kChild, child}, {kAnyModel, "world"}}));
  }
  note_unread(*root.Model()->Element(), notices);
  absl::StatusOr<std::optional<JointKind>> kind = read_joint(*root.Model()->JointByIndex(0), notices);
  if (!kind.ok()) return xml::error_at(joint, kind.status().code(), kind.status().message());
  if (kind->has_value() && !(*kind)->mimics.empty()) {
    notices.count("<mimic> of a joint between models, not simulated");
    (*kind)->mimics.clear();
  }
  return kind;
}

}  // namespace tessera
