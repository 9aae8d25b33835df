"""The scenes, a file each; `sims.scene.find_scenes` imports them all."""
