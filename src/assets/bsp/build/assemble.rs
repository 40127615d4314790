//! From a described map to a whole BSP file: the build's steps in order.

use super::brushes::{self, WALL};
use super::error::BuildError;
use super::faces::{DrawnFace, Surroundings, cell_faces, model_faces, solid_faces};
use super::leaf_lists::{invert, leafs_of_surface};
use super::map::MapBuilder;
use super::planes::Planes;
use super::shape::{Bounds, plane_axes};
use super::surfaces::{push_face, push_free_quad, push_mesh, push_patch};
use super::tree::Tree;
use super::vis::{Portal, visibility};
use crate::assets::bsp::file::Bsp;
use crate::assets::bsp::lumps::{Leaf, Model, Node};

/// Largest coordinate a map may use.
const LIMIT: i32 = 65_536;

/// Builds every lump.
pub fn assemble(map: &MapBuilder) -> Result<Bsp, BuildError> {
    let world = check_boxes(map)?;
    for (i, (patch, _)) in map.patches.iter().enumerate() {
        patch.check(i)?;
    }
    for (i, (mesh, _)) in map.meshes.iter().enumerate() {
        mesh.check(i)?;
    }
    let carving: Vec<Bounds> = map.solids.iter().filter(|s| s.carves).map(|s| s.bounds).collect();
    // Contacts and walls are a matter of the cells alone; only the file's tree has the solids taken away.
    let cell_tree = Tree::build(world, &map.cells, &[])?;
    let portals = portals(map, &cell_tree)?;
    let around = surroundings(map, &cell_tree, &portals)?;
    let tree = if carving.is_empty() {
        cell_tree
    } else {
        Tree::build(world, &map.cells, &carving)?
    };

    let mut bsp = Bsp {
        shaders: map.shaders.clone(),
        entities: entity_text(map),
        visibility: map.vised.then(|| visibility(map.cells.len(), &portals)),
        ..Bsp::default()
    };
    let mut planes = Planes::default();
    let boxes = brushes::world(map, &around, &tree, &mut bsp, &mut planes);
    push_world_surfaces(map, &around, &mut bsp);
    bsp.models.push(Model {
        mins: world.mins.as_vec3().to_array(),
        maxs: world.maxs.as_vec3().to_array(),
        first_surface: 0,
        surface_count: bsp.surfaces.len() as i32,
        first_brush: 0,
        brush_count: bsp.brushes.len() as i32,
    });
    push_tree(&tree, &boxes, &mut bsp, &mut planes);
    push_models(map, &mut bsp, &mut planes)?;
    bsp.planes = planes.list;
    Ok(bsp)
}

/// Checks that boxes have volume and fit the file; returns the world's bounds, walls included.
fn check_boxes(map: &MapBuilder) -> Result<Bounds, BuildError> {
    let cells = map.cells.iter().map(|c| ("cell", c.name.as_str(), c.bounds));
    let solids = map.solids.iter().map(|s| ("solid", "", s.bounds));
    let parts = map
        .models
        .iter()
        .flat_map(|m| m.solids.iter().map(|s| ("brush model", m.class.as_str(), s.bounds)));
    for (what, name, bounds) in cells.chain(solids).chain(parts) {
        let name = name.to_owned();
        if bounds.is_empty() {
            return Err(BuildError::Empty { what, name, bounds });
        }
        let limit = LIMIT - WALL;
        if bounds.mins.min_element() < -limit || bounds.maxs.max_element() > limit {
            return Err(BuildError::TooFar {
                what,
                name,
                bounds,
                limit,
            });
        }
    }
    let boxes = map.cells.iter().map(|c| c.bounds);
    let world = boxes.reduce(|a, b| a.union(&b)).ok_or(BuildError::NoCells)?;
    Ok(world.grown(WALL))
}

/// The portals asked for; cells that touch in any other place are an error, as no wall would part them.
fn portals(map: &MapBuilder, tree: &Tree) -> Result<Vec<Portal>, BuildError> {
    let name = |c: usize| map.cells[c].name.clone();
    let mut joined = std::collections::HashSet::new();
    let mut portals = Vec::new();
    for &(a, b) in &map.portals {
        let contact = map.cells[a].bounds.contact(&map.cells[b].bounds);
        let (face, rect) = contact.ok_or_else(|| BuildError::PortalNotShared { a: name(a), b: name(b) })?;
        if joined.insert((a.min(b), a.max(b))) {
            portals.push(Portal {
                cells: if face.is_max() { [a, b] } else { [b, a] },
                rect,
                axis: face.axis(),
            });
        }
    }
    for (a, cell) in map.cells.iter().enumerate() {
        for b in cells_in(tree, &cell.bounds.grown(1)) {
            let touching = a < b && cell.bounds.contact(&map.cells[b].bounds).is_some();
            if touching && !joined.contains(&(a, b)) {
                return Err(BuildError::TouchingCells { a: name(a), b: name(b) });
            }
        }
    }
    Ok(portals)
}

/// Cells whose interior meets a box, ascending.
fn cells_in(tree: &Tree, bounds: &Bounds) -> Vec<usize> {
    let mut cells = Vec::new();
    tree.leafs_in_box(bounds.mins.as_vec3(), bounds.maxs.as_vec3(), &mut |leaf| {
        cells.extend(tree.leafs[leaf].cell)
    });
    cells.sort_unstable();
    cells.dedup();
    cells
}

fn surroundings(map: &MapBuilder, cell_tree: &Tree, portals: &[Portal]) -> Result<Surroundings, BuildError> {
    let mut around = Surroundings {
        portals: vec![Vec::new(); map.cells.len()],
        solids: vec![Vec::new(); map.cells.len()],
        panels: vec![Vec::new(); map.cells.len()],
        cells_of_solid: Vec::with_capacity(map.solids.len()),
    };
    for portal in portals {
        for cell in portal.cells {
            around.portals[cell].push(portal.rect);
        }
    }
    for (number, solid) in map.solids.iter().enumerate() {
        // A face flush with a cell's wall still borders on that cell.
        let cells = cells_in(cell_tree, &solid.bounds.grown(1));
        for &cell in cells
            .iter()
            .filter(|&&c| solid.carves && solid.bounds.overlaps(&map.cells[c].bounds))
        {
            around.solids[cell].push(number);
        }
        around.cells_of_solid.push(cells);
    }
    for (number, panel) in map.panels.iter().enumerate() {
        let whole = map.cells[panel.cell].bounds.face(panel.face);
        let axes = plane_axes(panel.face.axis());
        let meets = |other: &Bounds| {
            let common = panel.rect.intersection(other);
            let axis = panel.face.axis();
            common.mins[axis] == common.maxs[axis] && axes.iter().all(|&a| common.mins[a] < common.maxs[a])
        };
        let earlier = || around.panels[panel.cell].iter().map(|&p| map.panels[p].rect);
        let free = !around.portals[panel.cell].iter().any(meets) && !earlier().any(|rect| meets(&rect));
        if !(whole.encloses(&panel.rect) && meets(&whole) && free) {
            return Err(BuildError::PanelNotOnFace {
                cell: map.cells[panel.cell].name.clone(),
                face: panel.face.name(),
                rect: panel.rect,
            });
        }
        around.panels[panel.cell].push(number);
    }
    Ok(around)
}

fn push_world_surfaces(map: &MapBuilder, around: &Surroundings, bsp: &mut Bsp) {
    let mut faces: Vec<DrawnFace> = Vec::new();
    for cell in 0..map.cells.len() {
        cell_faces(map, around, cell, &mut faces);
    }
    for solid in 0..map.solids.len() {
        solid_faces(map, around, solid, &mut faces);
    }
    for face in &faces {
        push_face(bsp, face);
    }
    for quad in &map.quads {
        push_free_quad(bsp, quad.corners, quad.paint);
    }
    for (patch, shader) in &map.patches {
        push_patch(bsp, patch, *shader);
    }
    for (mesh, shader) in &map.meshes {
        push_mesh(bsp, mesh, *shader);
    }
}

/// Nodes and leaves with the lists of surfaces and brushes (`boxes`) in each leaf. So far `bsp` holds only the world's.
fn push_tree(tree: &Tree, boxes: &[Bounds], bsp: &mut Bsp, planes: &mut Planes) {
    for node in &tree.nodes {
        bsp.nodes.push(Node {
            plane: planes.axial(node.axis, node.level),
            children: node.children,
            mins: node.bounds.mins.to_array(),
            maxs: node.bounds.maxs.to_array(),
        });
    }
    let surfaces: Vec<Vec<usize>> = bsp.surfaces.iter().map(|s| leafs_of_surface(tree, bsp, s)).collect();
    let surfaces = invert(tree.leafs.len(), &surfaces);
    let leafs_of_box = |bounds: &Bounds| {
        let mut leafs = Vec::new();
        tree.leafs_in_box(bounds.mins.as_vec3(), bounds.maxs.as_vec3(), &mut |leaf| {
            leafs.push(leaf)
        });
        leafs
    };
    let brushes: Vec<Vec<usize>> = boxes.iter().map(leafs_of_box).collect();
    let brushes = invert(tree.leafs.len(), &brushes);
    for (i, leaf) in tree.leafs.iter().enumerate() {
        bsp.leafs.push(Leaf {
            cluster: leaf.cell.map_or(-1, |cell| cell as i32),
            area: if leaf.cell.is_some() { 0 } else { -1 },
            mins: leaf.bounds.mins.to_array(),
            maxs: leaf.bounds.maxs.to_array(),
            first_leaf_surface: surfaces.ranges[i].0,
            leaf_surface_count: surfaces.ranges[i].1,
            first_leaf_brush: brushes.ranges[i].0,
            leaf_brush_count: brushes.ranges[i].1,
        });
    }
    bsp.leaf_surfaces = surfaces.numbers;
    bsp.leaf_brushes = brushes.numbers;
}

fn push_models(map: &MapBuilder, bsp: &mut Bsp, planes: &mut Planes) -> Result<(), BuildError> {
    for model in &map.models {
        let boxes = model.solids.iter().map(|s| s.bounds);
        let bounds = boxes.reduce(|a, b| a.union(&b)).ok_or_else(|| BuildError::EmptyModel {
            class: model.class.clone(),
        })?;
        let (first_surface, first_brush) = (bsp.surfaces.len() as i32, bsp.brushes.len() as i32);
        for solid in &model.solids {
            brushes::push_solid(bsp, planes, solid);
            let mut faces = Vec::new();
            model_faces(&solid.bounds, &solid.faces, &mut faces);
            for face in &faces {
                push_face(bsp, face);
            }
        }
        bsp.models.push(Model {
            mins: bounds.mins.as_vec3().to_array(),
            maxs: bounds.maxs.as_vec3().to_array(),
            first_surface,
            surface_count: bsp.surfaces.len() as i32 - first_surface,
            first_brush,
            brush_count: bsp.brushes.len() as i32 - first_brush,
        });
    }
    Ok(())
}

fn entity_text(map: &MapBuilder) -> Vec<u8> {
    let mut text = String::new();
    for entity in &map.entities {
        entity.write(&mut text);
    }
    let mut bytes = text.into_bytes();
    bytes.push(0);
    bytes
}
