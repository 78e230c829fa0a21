//! Compiling meshes with shaders: what is asked of a joint search, and the files that it gives.

use super::search::Ready;
use super::{Files, ModelFile, Request, Strategy};
use crate::emit::{LockedFile, LockedMesh, Transition, figure};
use crate::eval::program::Program;
use crate::eval::refusal;
use crate::front;
use crate::joint::{self, Joint, Settings, Way};
use crate::report::{JointReport, MeshReport};
use crate::scene::objects::Object;
use crate::search::{Found, Kept};
use crate::time::clock::Clock;
use crate::{Diagnostic, Result};
use lodc_mesh::write::{Level, Looks, Sight, glb, table};
use lodc_passes::Goal;
use lodc_passes::autolod::s_max;

/// What `--only` calls levels whose meshes alone are simpler, and whose shaders.
pub(super) const MESH: &str = "mesh";
pub(super) const SHADER: &str = "shader";

/// What a joint search adds to what is written.
#[derive(Default)]
pub(super) struct Meshes {
    /// The meshes, and the table of their distances.
    pub(super) files: Files,
    /// The file of the meshes, as the lock names it.
    pub(super) locked: Option<LockedFile>,
    /// From where on each is used.
    pub(super) levels: Vec<LockedMesh>,
    /// For each level its mesh.
    pub(super) of_levels: Vec<MeshReport>,
    /// For each level what is seen where it begins.
    pub(super) shown: Vec<Option<f64>>,
    /// What was looked at.
    pub(super) report: Option<JointReport>,
}

impl Request {
    /// Whether levels are to have simpler meshes alone.
    pub(super) fn is_of_meshes_alone(&self) -> bool {
        self.search != Strategy::Greedy && self.only.iter().any(|only| only == MESH)
    }
}

impl Ready {
    /// Refuses what does not go together with levels of meshes.
    pub(super) fn may_join(&self, request: &Request) -> Result<()> {
        if request.search == Strategy::Greedy {
            return Ok(());
        }
        let refuse =
            |why: &str, way_out: &str| Err(Diagnostic::error(why).with_note(way_out.to_owned()));
        if request.transition.unwrap_or_default() != Transition::Pop {
            return refuse(
                "two meshes are not drawn in one another's place by a shader",
                "leave `--transition` out: levels with meshes pop, and are chosen so that little of it is seen",
            );
        }
        if request.per_pixel {
            return refuse(
                "a pixel cannot choose its mesh",
                "leave `--per-pixel` or `--search` out",
            );
        }
        if self.scene.goal != Goal::default() {
            return refuse(
                "levels of meshes and shaders are to save time, and nothing else",
                "leave `--goal` out, and `goal` in the scene",
            );
        }
        if self.scene.object == Object::Screen {
            return refuse(
                "there is no mesh to simplify: the shader draws by its vertices' indices alone",
                "name an object in the scene, or leave `--search` out",
            );
        }
        Ok(())
    }

    /// The joint search that a request asks for, after that of its shaders.
    pub(super) fn join(
        &self,
        request: &Request,
        vertex: &Program,
        found: &Found,
        kept: &Kept,
        clock: Option<&mut dyn Clock>,
    ) -> Result<Option<Joint>> {
        let way = match request.search {
            Strategy::Greedy => return Ok(None),
            Strategy::Separate => Way::Separate,
            Strategy::Exhaustive => Way::Exhaustive,
            Strategy::Interleaved => Way::Interleaved,
        };
        let fragment = self.fragment()?;
        let mut settings = Settings {
            way,
            ..Settings::default()
        };
        if let Some(views) = request.mesh_views {
            settings.simplification.views = views;
        }
        settings.meshes = request.meshes.unwrap_or(settings.meshes);
        settings.shaders = request.shaders.unwrap_or(settings.shaders);
        if request.only.iter().any(|only| only == SHADER) {
            settings.meshes = 1;
        }
        let asked = (&settings, kept);
        let joint = joint::find(&self.stand(vertex), &fragment, found, asked, clock);
        joint
            .map(Some)
            .map_err(|refused| refusal(&refused, &self.source))
    }

    /// The files of the meshes of levels, and what lock and report say of them.
    pub(super) fn meshes(&self, request: &Request, joint: &Joint) -> Result<Meshes> {
        let triangles = |mesh: usize| joint.meshes[mesh].indices.len() / 3;
        // Neighbouring levels share a mesh.
        let mut runs: Vec<(usize, f64, f64)> = Vec::new();
        for level in &joint.levels {
            if runs.last().is_none_or(|(mesh, _, _)| *mesh != level.mesh) {
                runs.push((level.mesh, level.level.autolod, level.level.distance));
            }
        }
        let mut meshes = Meshes {
            shown: joint.levels.iter().map(|level| level.shown).collect(),
            report: Some(JointReport::new(joint, request.search.name())),
            ..Meshes::default()
        };
        let folder = request.beside("lod");
        let file = folder.join(format!("{}.glb", request.stem()));
        let name = |path: &std::path::Path| {
            let name = path.file_name().unwrap_or_default();
            name.to_string_lossy().into_owned()
        };
        let named = format!("{}/{}", name(&folder), name(&file));
        meshes.of_levels = (joint.levels.iter())
            .map(|level| MeshReport {
                file: (level.mesh > 0).then(|| named.clone()),
                triangles: triangles(level.mesh),
            })
            .collect();
        if runs.len() < 2 {
            return Ok(meshes);
        }
        let sight = Sight {
            fov: self.scene.fov,
            scale: s_max(&self.scene.model.as_mat4().to_cols_array_2d()),
            ..Sight::default()
        };
        let levels: Vec<Level<'_>> = (runs.iter().enumerate())
            .map(|(at, (mesh, _, distance))| Level {
                mesh: &joint.meshes[*mesh],
                distance: if at == 0 { 0.0 } else { figure(*distance) },
            })
            .collect();
        let looks = match self.scene.model_files.first() {
            Some(model) => ModelFile::read(&self.beside_scene(model))?.looks()?,
            None => Looks::default(),
        };
        let bytes = glb(&levels, &sight, &looks).map_err(|why| {
            Diagnostic::error(format!("cannot write `{}`: {why}", file.display()))
                .with_note("ask for fewer meshes with `--meshes`")
        })?;
        meshes.locked = Some(LockedFile {
            file: named,
            hash: front::hash(&bytes),
        });
        let of_lock = runs.iter().enumerate();
        meshes.levels = of_lock
            .map(|(level, (mesh, autolod, distance))| LockedMesh {
                level,
                autolod: *autolod as f32,
                distance: figure(*distance),
                triangles: triangles(*mesh),
            })
            .collect();
        let table = table(&levels, &sight, &name(&file), &[]);
        meshes
            .files
            .push((file.with_extension("meshes.toml"), table.into_bytes()));
        meshes.files.push((file, bytes));
        Ok(meshes)
    }
}

/// A search's levels without those whose shader is that of the level before: what is emitted.
pub(super) fn of_shaders(found: &Found) -> Found {
    let mut shaders = found.clone();
    shaders
        .levels
        .dedup_by_key(|level| level.shader.fingerprint());
    shaders
}
