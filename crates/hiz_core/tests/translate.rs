//! Every shader module translates to the languages of wgpu's native backends.
//! These are SPIR-V (Vulkan), MSL (Metal) and HLSL (Direct3D 12).
//! The other tests run on Vulkan alone.

use hiz_core::testing::shaders;
use naga::back::pipeline_constants::process_overrides;
use naga::back::{PipelineConstants, hlsl, msl, spv};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Module, ShaderStage};

const FLAG: &[f64] = &[0.0, 1.0];
const ONE_TO_THREE: &[f64] = &[1.0, 2.0, 3.0];

/// The values that pipelines give each override.
const VALUES: &[(&str, &[f64])] = &[
    ("ABSENT", FLAG),
    ("AMONG", FLAG),
    ("APPEND", FLAG),
    ("BOTH", FLAG),
    ("BY_INDEX", FLAG),
    ("BY_ROWS", FLAG),
    ("CAPPED", FLAG),
    ("CHUNKS", ONE_TO_THREE),
    ("DESCENT", FLAG),
    ("EARLY_SET", &[0.0, 1.0, 2.0]),
    ("EDGE_TEXEL", FLAG),
    ("FARTHEST", FLAG),
    ("FIRST", ONE_TO_THREE),
    ("FIT_VOLUME", FLAG),
    ("FLIPS", FLAG),
    ("FOOTPRINT_LOG2", &[0.0, 1.0, 2.0, 3.0]),
    ("FROM_SOURCE", FLAG),
    ("INDEXED", FLAG),
    ("INDEX_TEXEL", ONE_TO_THREE),
    ("LEVELS", ONE_TO_THREE),
    ("LIST", FLAG),
    ("LOD_RULE", &[0.0, 1.0, 2.0, 3.0]),
    ("LOOKS_AT_ACCEPTED", FLAG),
    ("MASK", FLAG),
    ("NEAREST", FLAG),
    ("ODD_X", FLAG),
    ("ODD_Y", FLAG),
    ("ONE_SAMPLE", FLAG),
    ("PLANES", &[1.0, 4.0]),
    ("RECEIVERS", FLAG),
    ("RECORD_WORDS", &[4.0, 5.0]),
    ("REGION", FLAG),
    ("RESERVED", FLAG),
    ("REVERSED", FLAG),
    ("SAMPLES", &[2.0, 4.0, 8.0]),
    ("SAMPLE_COVERAGE", FLAG),
    ("BY_TWO_ROWS", FLAG),
    ("SHARED", FLAG),
    ("SHOWN", FLAG),
    ("SOME", FLAG),
    ("SORTED", FLAG),
    ("STATISTICS", FLAG),
    ("STEPS", ONE_TO_THREE),
    ("TALL", FLAG),
    ("TEXELS", ONE_TO_THREE),
    ("TIER", &[0.0, 1.0, 2.0]),
    ("VERDICTS", FLAG),
];

/// Sets of constants for a module.
/// Each value of each override is in one of them at least.
/// naga drops no branch that a constant decides, so other combinations show no other code.
fn variants(module: &Module) -> Vec<PipelineConstants> {
    let overrides: Vec<(String, &[f64])> = module
        .overrides
        .iter()
        .map(|(_, declared)| {
            let name = declared.name.clone().expect("an override has a name");
            let known = VALUES.iter().find(|(known, _)| *known == name);
            let (_, values) = known.unwrap_or_else(|| panic!("which values has {name}?"));
            (name, *values)
        })
        .collect();
    let count = overrides.iter().map(|(_, values)| values.len()).max().unwrap_or(1);
    let set = |k: usize| overrides.iter().map(move |(n, v)| (n.clone(), v[k % v.len()]));
    (0..count).map(|k| set(k).collect()).collect()
}

/// An entry point of a module with its constants put in.
struct Shader<'a> {
    module: &'a Module,
    info: &'a ModuleInfo,
    entry: (ShaderStage, String),
}

impl Shader<'_> {
    fn spirv(&self) -> Result<Vec<u32>, String> {
        let (shader_stage, entry_point) = self.entry.clone();
        let options = spv::Options { lang_version: (1, 3), ..spv::Options::default() };
        let pipeline = spv::PipelineOptions { shader_stage, entry_point };
        spv::write_vec(self.module, self.info, &options, Some(&pipeline)).map_err(|e| e.to_string())
    }

    fn metal(&self) -> Result<String, String> {
        let options = msl::Options { lang_version: (2, 4), ..msl::Options::default() };
        let pipeline =
            msl::PipelineOptions { entry_point: Some(self.entry.clone()), ..Default::default() };
        let (text, written) = msl::write_string(self.module, self.info, &options, &pipeline)
            .map_err(|e| e.to_string())?;
        written
            .entry_point_names
            .into_iter()
            .try_for_each(|name| name.map(drop))
            .map_err(|e| e.to_string())?;
        Ok(text)
    }

    fn direct3d(&self) -> Result<String, String> {
        let mut text = String::new();
        let options =
            hlsl::Options { shader_model: hlsl::ShaderModel::V6_0, ..hlsl::Options::default() };
        let pipeline = hlsl::PipelineOptions { entry_point: Some(self.entry.clone()) };
        let written = hlsl::Writer::new(&mut text, &options, &pipeline)
            .write(self.module, self.info, None)
            .map_err(|e| e.to_string())?;
        written
            .entry_point_names
            .into_iter()
            .try_for_each(|name| name.map(drop))
            .map_err(|e| e.to_string())?;
        Ok(text)
    }
}

/// No language has an exception today; one would be listed here with its reason.
#[test]
fn every_module_translates_to_every_language() {
    let (mut wrong, mut count) = (Vec::new(), 0);
    for (name, text) in shaders::modules() {
        let module = naga::front::wgsl::parse_str(&text)
            .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
        let info = Validator::new(ValidationFlags::all(), Capabilities::default())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
        for (point, constants) in module
            .entry_points
            .iter()
            .flat_map(|p| variants(&module).into_iter().map(move |c| (p, c)))
        {
            let what = format!("{name}, {}, {constants:?}", point.name);
            let entry = Some((point.stage, point.name.as_str()));
            let (module, info) = process_overrides(&module, &info, entry, &constants)
                .unwrap_or_else(|e| panic!("{what}: {e}"));
            let entry = (point.stage, point.name.clone());
            let shader = Shader { module: &module, info: &info, entry };
            for (language, length) in [
                ("SPIR-V", shader.spirv().map(|words| words.len())),
                ("MSL", shader.metal().map(|text| text.len())),
                ("HLSL", shader.direct3d().map(|text| text.len())),
            ] {
                count += 1;
                if !matches!(length, Ok(1..)) {
                    wrong.push(format!("{language}: {what}: {length:?}"));
                }
            }
        }
    }
    eprintln!("{count} translations");
    assert!(wrong.is_empty(), "{} of {count}: {}", wrong.len(), wrong.join("\n"));
    assert!(count > 500, "the search for shaders is blind: {count}");
}
