"""The format of what `Diagnosis.to_json` writes: another one may mean other things by the same names."""

FORMAT = 1
