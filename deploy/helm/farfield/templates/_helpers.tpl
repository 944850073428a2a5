{{- define "farfield.labels" -}}
app.kubernetes.io/name: farfield
app.kubernetes.io/instance: {{ .Release.Name }}
app.kubernetes.io/managed-by: {{ .Release.Service }}
helm.sh/chart: {{ .Chart.Name }}-{{ .Chart.Version }}
{{- end }}

{{- define "farfield.selector" -}}
app.kubernetes.io/name: farfield
app.kubernetes.io/instance: {{ .Release.Name }}
{{- end }}

{{/* Where the store and the broker are, for the API and workers. */}}
{{- define "farfield.environment" -}}
- name: FARFIELD_STORE
  value: {{ .Values.store.url | quote }}
- name: AWS_REGION
  value: {{ .Values.store.region | default "us-east-1" | quote }}
{{- with .Values.store.endpoint }}
- name: AWS_ENDPOINT_URL
  value: {{ . | quote }}
{{- end }}
{{- with .Values.store.secret }}
- name: AWS_ACCESS_KEY_ID
  valueFrom: { secretKeyRef: { name: {{ . | quote }}, key: AWS_ACCESS_KEY_ID } }
- name: AWS_SECRET_ACCESS_KEY
  valueFrom: { secretKeyRef: { name: {{ . | quote }}, key: AWS_SECRET_ACCESS_KEY } }
{{- end }}
- name: FARFIELD_BROKER
{{- if .Values.redis.enabled }}
  value: redis://{{ .Release.Name }}-redis:6379/0
{{- else if .Values.redis.secret }}
  valueFrom: { secretKeyRef: { name: {{ .Values.redis.secret | quote }}, key: url } }
{{- else }}
  value: {{ required "redis.url or redis.secret is needed where redis.enabled is false" .Values.redis.url | quote }}
{{- end }}
{{- end }}

{{- define "farfield.pod" -}}
{{- with .Values.serviceAccount }}
serviceAccountName: {{ . | quote }}
{{- end }}
automountServiceAccountToken: false
{{- with .Values.images.pullSecrets }}
imagePullSecrets:
{{- range . }}
  - name: {{ . | quote }}
{{- end }}
{{- end }}
securityContext:
  runAsNonRoot: true
  runAsUser: 10001
  runAsGroup: 10001
  fsGroup: 10001
  seccompProfile: { type: RuntimeDefault }
{{- end }}

{{- define "farfield.container" -}}
allowPrivilegeEscalation: false
readOnlyRootFilesystem: true
capabilities: { drop: [ALL] }
{{- end }}
