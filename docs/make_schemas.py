"""Writes the JSON Schemas of all documents into ``docs/schema``."""

import json
from pathlib import Path

from tribrach.report.json_result import result_model
from tribrach.report.schema.base import Document
from tribrach.report.schema.baseline import BaselineDocument
from tribrach.report.schema.calibration import CalibrationDocument
from tribrach.report.schema.check import CheckDocument
from tribrach.report.schema.comparison import ComparisonDocument, RegressionDocument
from tribrach.report.schema.completeness import CompletenessDocument
        "diff": DiffDocument,
