data=
{"config": {"name": "test", "root_COR_file": "net.cor", "root_OBS_file": "net.obs",
 "center_latitude": 48.0, "local_center": [1000.0, 2000.0, 0.0], "use_proj": false,
 "proj_def": "", "compute_type": 0, "files_unit": 1, "refraction": 0.12,
 "internal_constraints": false, "coord_cov_file": ""}}